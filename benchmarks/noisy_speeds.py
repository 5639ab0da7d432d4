"""Effects hidden in logs of noisy speeds: are they found, and how true are the probabilities?

    make -C firmware plant && python benchmarks/noisy_speeds.py [--counts] [--draws 1] [--seed 0] [KIND...]

Recordings of `hidden.py`, whose counts are made a log of speeds as others have it: each the mean over the row before,
with noise of 0.2 to 2 % of the motion beside the encoder's rounding, white or remembered for up to ten rows. A cause
counts as found where it is named, or among the alternatives that the recording does not tell from the one named. The
probabilities are those of all effects tried, and of none. With --counts the recordings are left as they are.
"""

import argparse
import dataclasses
import time

import numpy as np
from _calibration import alike, calibration, is_found, log_loss, told
from hidden import SINGLE, draw
from scipy.signal import lfilter

from jaxmotor import JaxmotorError, Recording, diagnose
from jaxmotor._runtime import keep_programs
from jaxmotor.recording import Segment

NOISE = (0.002, 0.02)
"""Of the root mean square speed."""
MEMORY_ROWS = 10.0


def as_speeds(recording: Recording, rng: np.random.Generator) -> Recording:
    """`recording` of counts as a log of speeds over the row before, with noise."""
    assert recording.period_s is not None and recording.counts_per_rev is not None
    per_count = 2 * np.pi / recording.counts_per_rev / recording.period_s
    turns = [
        np.diff(one.count, prepend=one.count[:1]) * per_count for one in recording.segments if one.count is not None
    ]
    every = np.concatenate(turns)
    level = np.exp(rng.uniform(*np.log(NOISE))) * float(np.sqrt(np.mean(every**2)))
    memory = float(rng.choice([0.0, rng.uniform(1.0, MEMORY_ROWS)]))
    keep = np.exp(-1 / memory) if memory else 0.0
    noise = level * np.sqrt(1 - keep**2) * np.asarray(lfilter([1.0], [1.0, -keep], rng.standard_normal(len(every))))
    ends = np.cumsum([len(one) for one in turns])
    parts = np.split(every + noise, ends[:-1])
    pairs = zip(recording.segments, parts, strict=True)
    segments = tuple(_with_speed(segment, part) for segment, part in pairs if len(segment) > 2)
    return dataclasses.replace(
        recording, segments=segments, counts_per_rev=None, speed_window_s=recording.period_s, duty_delay_s=0.0
    )


def _with_speed(segment: Segment, speed: np.ndarray) -> Segment:
    """Without its first row, of which the speed is not known, where it begins in motion."""
    first = 0 if segment.at_rest else 1
    rows = slice(first, None)
    tick = None if segment.tick is None else segment.tick[rows] - segment.tick[first]
    return dataclasses.replace(
        segment,
        start_s=segment.start_s + float(segment.time_s[first]),
        time_s=segment.time_s[rows] - segment.time_s[first],
        volts=segment.volts[rows],
        duty=None if segment.duty is None else segment.duty[rows],
        tick=tick,
        count=None,
        supply_V=None,
        current_A=None,
        extra={},
        speed_rad_s=speed[rows],
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--draws", type=int, default=1)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--counts", action="store_true")
    parser.add_argument("kinds", nargs="*", default=["none", *SINGLE])
    asked = parser.parse_args()
    keep_programs(threads=True)
    every: list[tuple[float, bool]] = []
    family: list[tuple[float, bool]] = []
    right = total = 0
    print("| hidden | seed | named | probability | chi2 of held-out data | found | s |")
    print("|---|---|---|---|---|---|---|")
    for seed in range(asked.seed, asked.seed + asked.draws):
        for kind in asked.kinds:
            hidden = draw(() if kind == "none" else tuple(kind.split("+")), seed)
            recording = hidden.recording
            if not asked.counts:
                recording = as_speeds(recording, np.random.default_rng([seed, len(kind)]))
            begin = time.perf_counter()
            try:
                found = diagnose(recording)
            except JaxmotorError as error:
                print(f"| {kind} | {seed} | {error} | | | |", flush=True)
                continue
            seconds = time.perf_counter() - begin
            names = "; ".join(" or ".join(alike(one)) for one in found.effects)
            every += told(hidden, found)
            for one in found.effects:
                family.append((one.family_probability, bool(set(alike(one)) & set(hidden.truth))))
            good, total = is_found(hidden, found), total + 1
            right += good
            sure = ", ".join(f"{one.probability:.2f} ({one.family_probability:.2f})" for one in found.effects)
            print(
                f"| {kind} | {seed} | {names or 'none'} | {sure} | {found.held_out.drift_before:.3g} -> "
                f"{found.held_out.drift_after:.3g}, {found.verdict} | {'yes' if good else 'NO'} | {seconds:.0f} |",
                flush=True,
            )
    print(
        f"found {right} of {total}; probabilities, true/said: {calibration(every)}; log loss {log_loss(every):.3f}; "
        f"of those named, with alternatives: {calibration(family)}"
    )


if __name__ == "__main__":
    main()
