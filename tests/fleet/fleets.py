"""Small fleets of known motors."""

import numpy as np
from testing.made import plan, recording, sine, step

from jaxmotor.recording import Recording

GAINS = np.linspace(9.0, 13.0, 5)
SHORT = [sine(0.73, 240), sine(2.9, 240), sine(7.7, 240), step(5.1, 121), step(-3.3, 121)]
"""No run is as long as a quarter of all: a diagnosis packs them as it does other recordings, for the same programs."""


def short(seed: int, **about) -> Recording:
    """A motor whose recording takes little time to fit."""
    return recording(seed, runs=SHORT, **about)


def with_lost_ticks(given: Recording, rng: np.random.Generator) -> Recording:
    """`given` with ticks missing in its first segment."""
    import dataclasses

    first = given.segments[0]
    keep = np.ones(len(first), bool)
    keep[rng.choice(np.arange(50, len(first)), 3, replace=False)] = False
    names = ("time_s", "volts", "tick", "count")
    cut = dataclasses.replace(first, **{name: getattr(first, name)[keep] for name in names})
    return dataclasses.replace(given, segments=(cut, *given.segments[1:]))


__all__ = ["GAINS", "SHORT", "plan", "recording", "short", "sine", "step", "with_lost_ticks"]
