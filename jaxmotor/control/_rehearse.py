"""A plan run on a model: the recording that `jaxmotor record` would make of this motor.

One free simulation goes through all experiments and the rests between them, as the motor would; closed loops are closed
by the board's law (`SpeedLaw`), with its counts, duties and limit.
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from jaxmotor._errors import JaxmotorError
from jaxmotor._precision import in_float64
from jaxmotor.bench import Plan, experiment_volts
from jaxmotor.control._hardware import Hardware
from jaxmotor.control._run import run_on
from jaxmotor.estimate import Model
from jaxmotor.motor import AbstractController, SpeedLaw, command
from jaxmotor.prediction import bucket
from jaxmotor.recording import Recording, Segment

Scalar = Float[Array, ""]
STILL = 10
"""Ticks without a count that mean rest."""


class _Script(AbstractController):
    """Voltages or loops, row by row."""

    law: SpeedLaw
    """Gains (n,), 0 where the row is no loop."""
    loop: Float[Array, " n"]
    """1 in a closed loop, else 0."""
    first: Float[Array, " n"]
    """1 where an experiment begins."""

    def begin(self) -> tuple[Scalar, Int[Array, ""]]:
        """Integral [V] and row."""
        return jnp.zeros_like(self.law.limit_V), jnp.zeros((), jnp.int32)

    def volts(self, memory: Any, reference: Scalar, turned: Scalar, duration: Scalar) -> tuple[Scalar, Any]:
        integral, row = memory
        law = self.law._replace(gain=self.law.gain[row], integral_gain=self.law.integral_gain[row])
        integral = jnp.where(self.first[row] > 0, 0.0, integral)

        def asked(volts: Scalar) -> Scalar:
            return jnp.where(self.loop[row] > 0, volts, reference)

        volts, integral = command(law, reference - turned / duration, integral, duration, asked)
        return volts, (integral, row + 1)


class _Part(NamedTuple):
    """Rows of one segment."""

    kind: str
    experiment: int
    begin: int
    end: int


def simulate_plan(model: Model, plan: Plan, hardware: Hardware, *, seed: int = 0) -> Recording:
    """The recording of `model` under `plan` on `hardware`; `seed` draws where within a count the encoder begins.

    **Raises:** `JaxmotorError` where the plan's period is not the hardware's, or its voltages exceed the supply.
    """
    if abs(plan.period_s - hardware.period_s) > 1e-9:
        raise JaxmotorError(f"{plan.name}: its period of {plan.period_ms} ms is not the rig's {hardware.period_s:g} s")
    parts, asked, loops = _script(plan, hardware)
    begin = np.random.default_rng(seed).uniform()
    counts, volts = _simulated(model, hardware, asked, loops, begin)
    count = counts.astype(np.int64)
    duty = np.rint(volts / hardware.step_V).astype(np.int64)
    return Recording(
        tuple(_segment(plan, hardware, part, duty, count) for part in parts),
        plan.name,
        period_s=hardware.period_s,
        counts_per_rev=hardware.counts_per_rev,
        duty_full_scale=float(hardware.full_scale),
        supply_V=hardware.supply_V,
        drive="coast" if plan.drive == "coast" else "brake",
        duty_delay_s=hardware.delay_s or None,
        header={**plan.header, "rig": "simulated", "plan": plan.name},
    )


def _script(plan: Plan, hardware: Hardware) -> tuple[list[_Part], np.ndarray, np.ndarray]:
    """Parts, (n,) voltages or references, and (4, n) of gain, integral gain, loop, first."""
    parts: list[_Part] = []
    asked: list[np.ndarray] = []
    loops: list[np.ndarray] = []
    row = 0
    for index, experiment in enumerate(plan.experiments):
        volts = experiment_volts(plan, index, hardware.supply_V)
        table = np.zeros((4, len(volts)))
        if experiment.kind == "closed_loop":
            p = experiment.parameters
            volts = np.full(len(volts), float(p["reference_rad_s"]))
            table[:3] = np.array([[p["gain"]], [p["integral_gain"]], [1.0]])
        for kind, values, about in (
            ("rest", np.zeros(experiment.rest_ticks), np.zeros((4, experiment.rest_ticks))),
            (experiment.kind, volts, table),
        ):
            if len(values):
                about[3, 0] = 1.0
                parts.append(_Part(kind, index if kind == experiment.kind else -1, row, row + len(values)))
                asked.append(values)
                loops.append(about)
                row += len(values)
    return parts, np.concatenate(asked), np.concatenate(loops, axis=1)


@in_float64
def _simulated(
    model: Model, hardware: Hardware, asked: np.ndarray, loops: np.ndarray, begin: float
) -> tuple[np.ndarray, np.ndarray]:
    """(n,) count at each row, and (n,) voltage set [V]."""
    size = bucket(len(asked))
    padded = np.concatenate([loops, np.zeros((4, size - len(asked)))], axis=1)
    gain, integral_gain, loop, first = map(jnp.asarray, padded)
    law = SpeedLaw.of(0.0, 0.0, hardware.supply_V, hardware.step_V)._replace(gain=gain, integral_gain=integral_gain)
    motors = jax.tree.map(lambda leaf: leaf[None], model.whole)
    counts, volts = run_on(hardware, motors, _Script(law, loop, first), asked, np.array([begin]))
    return counts[0], volts[0]


def _segment(plan: Plan, hardware: Hardware, part: _Part, duty: np.ndarray, count: np.ndarray) -> Segment:
    rows = slice(part.begin, part.end)
    tick = np.arange(part.end - part.begin)
    before = count[max(0, part.begin - STILL) : part.begin + 1]
    return Segment(
        part.kind,
        round(part.begin * hardware.period_s, 6),
        bool(part.begin == 0 or (len(before) > STILL and (before == before[0]).all())),
        {} if part.experiment < 0 else dict(plan.experiments[part.experiment].parameters),
        tick * hardware.period_s,
        duty[rows] * hardware.step_V,
        tick=tick,
        duty=duty[rows],
        count=count[rows],
    )
