"""A recording packed for simulation, with its solver."""

import dataclasses

import numpy as np

from jaxmotor.diagnosis._request import Request
from jaxmotor.diagnosis._solve import Solver, is_short
from jaxmotor.diagnosis._split import Part
from jaxmotor.diagnosis._trial import Trial, of_means, rig_of, trial_of
from jaxmotor.prediction import PADDED, Noise, Packed, lowered, pack, without_transients
from jaxmotor.recording import Recording


@dataclasses.dataclass(frozen=True, eq=False)
class Study:
    """A recording ready to be explained."""

    recording: Recording
    packed: Packed
    trial: Trial
    solver: Solver
    timed: bool
    """Packed for motors with a timing offset."""
    pole_rad_s: float
    """Of the motors, about."""

    def quieter(self, share: float) -> "Study":
        """The same in a noise of this `share` of the mean square that was estimated."""
        noise = lowered(self.packed.observation.noise, share, self.packed.observation.kind == "turn")
        return study_of(self.recording, self.pole_rad_s, self.timed, self.solver.request, noise)

    def rows(self, parts: tuple[Part, ...]) -> np.ndarray:
        """(sequence, row) those of `parts`."""
        segment, row = self.packed.segment_of, self.packed.row_of
        own = [(segment == index) & (rows.start <= row) & (row < rows.stop) for index, rows in parts]
        return np.logical_or.reduce(own)


def study_of(
    recording: Recording,
    pole: float,
    timed: bool = False,
    request: Request | None = None,
    noise: Noise | None = None,
) -> Study:
    """`recording`, to be explained by motors with about this `pole` [rad/s], `timed` with a timing offset; `noise` is
    estimated where it is not given, once for each recording of a `request`."""
    request = request or Request()
    moving = tuple(
        index for index, segment in enumerate(recording.segments) if segment.kind != "rest" and len(segment) >= 2
    )
    shape = PADDED._replace(sequences=_sequences([len(recording.segments[k]) for k in moving]))
    packed = pack(recording, moving, shape, timed, noise=noise or request.noise_of(recording, timed))
    if noise is None:
        request.keep_noise(recording, timed, packed.observation.noise)
    packed = without_transients(recording, packed)
    trial = trial_of(recording, packed, pole)
    if request.seeks_window and is_short(trial):
        trial = of_means(trial)
    rig = rig_of(recording, trial)
    solver = Solver(trial, noise_known=packed.observation.floor_known, request=request, rig=rig)
    return Study(recording, packed, trial, solver, timed, pole)


def _sequences(rows: list[int]) -> int:
    """As many as shorten what is simulated one row after the other; few numbers, for few programs."""
    if len(rows) == 1:
        return 1
    if len(rows) <= 4 or max(rows) >= sum(rows) / 4:
        return 4
    return 8 if len(rows) <= 8 else 16
