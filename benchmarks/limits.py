"""How weak an effect may be and still be named: the detection limits of `diagnose`.

    make -C firmware plant && python benchmarks/limits.py [--draws 1] [--first 40] [EFFECT...]

Each effect is hidden at its usual size (`hidden.py`) times 0.3, 0.1, 0.03 and 0.01. The limit is the smallest of these
at which at least half of the draws are named rightly, with all larger ones; the sizes are those of the first draw.
"""

import argparse
import sys

from blind import is_right
from hidden import SINGLE, Sizes, draw

from jaxmotor._runtime import keep_programs
from jaxmotor.diagnosis import diagnose

SCALES = (0.3, 0.1, 0.03, 0.01)


def found(kind: str, scale: float, seeds: range) -> tuple[float, Sizes]:
    """The share of draws in which the effect was named, and its size in the first."""
    right, sizes = [], {}
    for seed in seeds:
        hidden = draw((kind,), seed, scale)
        right.append(is_right(kind, hidden, diagnose(hidden.recording)))
        sizes = sizes or hidden.truth[kind]
    return sum(right) / len(right), sizes


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("effects", nargs="*", default=[name for name in SINGLE if name != "coast_drive"])
    parser.add_argument("--draws", type=int, default=1)
    parser.add_argument("--first", type=int, default=40)
    chosen = parser.parse_args()
    keep_programs(threads=True)
    print("| effect | named at, of its usual size | that is |")
    print("|---|---|---|")
    for kind in chosen.effects:
        limit, size = "1", draw((kind,), chosen.first).truth[kind]
        for scale in SCALES:
            share, sizes = found(kind, scale, range(chosen.first, chosen.first + chosen.draws))
            print(f"{kind} x {scale}: {share:.2f}", file=sys.stderr, flush=True)
            if share < 0.5:
                break
            limit, size = f"{scale:g}", sizes
        print(f"| `{kind}` | {limit} | {', '.join(f'{k} {v:.3g}' for k, v in size.items())} |", flush=True)


if __name__ == "__main__":
    main()
