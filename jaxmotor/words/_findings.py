"""What a diagnosis found, in sentences without their full stop."""

import math
from collections.abc import Callable

from jaxmotor.diagnosis import Diagnosis, FoundEffect, Look, LoopGain, MissingVolts
from jaxmotor.estimate import Noise
from jaxmotor.motor import EFFECTS


def floor(known: bool) -> str:
    """What a chi2 per sample of 1 stands for, by whether the floor was known beforehand."""
    return "the encoder's rounding" if known else "the residual of the best flexible model of this log"


def noise_words(noise: Noise) -> str:
    """The noise of one reading in the log's unit."""
    if noise.known:
        return f"rounding to whole {noise.unit.name}"
    unit = noise.unit.name
    what = "" if noise.measured == "speed" else " on the turn from row to row"
    step = "" if noise.step is None else f"; readings come in steps of {noise.step / noise.unit.si:.4g} {unit}"
    level, new = noise.level / noise.unit.si, noise.row_to_row / noise.unit.si
    return f"{level:.3g} {unit}{what}, of which {new:.3g} {unit} is new in each row{step}"


def of_rounding(missing: MissingVolts) -> str:
    """The part of the missing volts that the encoder makes, after a comma; nothing where that is not known."""
    if not math.isfinite(missing.noise_V):
        return ""
    return f", of which the encoder's rounding makes {1e3 * missing.noise_V:.3g} mV"


def nothing_left() -> str:
    """Of a recording that a linear motor describes."""
    return "nothing that this recording shows: the linear model reaches the floor"


def seen_in(look: Look) -> str:
    """How much of the missing volts depends on what."""
    return f"{100 * look.share:.0f} % of that: {look.text} (by chance {100 * max(look.chance, 0.01):.0f} %)"


def looks_like(diagnosis: Diagnosis) -> str | None:
    """What is left over looks like, where no cause is named for it; None where nothing is."""
    look = diagnosis.looks_like
    if look is None:
        return None
    if diagnosis.undecided:
        return f"nothing is left over, but there may be {look.text}"
    also = "beside that, what is left" if diagnosis.effects else "what is missing"
    more = "no further cause is named" if diagnosis.effects else "no cause is named"
    return f"{also} looks like {look.text}; {more}: this says where to look, not why"


def may_be(found: FoundEffect, name: Callable[[str], str]) -> str | None:
    """Which rivals the effect cannot be told from, each called by `name`; None where there are none."""
    equal = [rival.name for rival in found.rivals if rival.inseparable]
    wider = [name(rival) for rival in equal if found.name in EFFECTS[rival].contains]
    same = [name(rival) for rival in equal if found.name not in EFFECTS[rival].contains]
    told = []
    if same:
        told.append(f"may as well be {' or '.join(same)}; this recording cannot tell them apart")
    if wider:
        told.append(f"{' or '.join(wider)}, which contains it, does no better: the recording shows no more than this")
    return "; ".join(told) if told else None


def likely(found: FoundEffect) -> str:
    """The effect's probability, in brackets after its name."""
    told = f"probability {100 * found.probability:.0f} %"
    if any(rival.inseparable for rival in found.rivals):
        told += f", with what it may as well be {100 * found.family_probability:.0f} %"
    return f" ({told})"


def loop_of(gain: LoopGain) -> str:
    """Which closed loop, and whether the motors know it."""
    loop = gain.before
    known = "no closed loop was fitted" if gain.held_out else "closed loops were fitted: there is nothing else"
    return f"{loop.kind} loop of segment {loop.segment} at {loop.reference_rad_s:.3g} rad/s ({known})"


LOOP = (
    ("steady_error_rad_s", "steady error", 1.0, "rad/s"),
    ("overshoot_percent", "overshoot", 1.0, "%"),
    ("rise_time_s", "rise time", 1e3, "ms"),
)
"""What is told of a closed loop: attribute, name, factor and unit for people."""
