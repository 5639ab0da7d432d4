"""A short pulse each way before the plan: what the count does tells what is wired wrong."""

import dataclasses
import itertools
from collections.abc import Iterator

from jaxmotor.bench._log import RunLog
from jaxmotor.bench._protocol import RecorderError
from jaxmotor.bench._session import Session
from jaxmotor.bench._slots import Rig, Slot, layout
from jaxmotor.bench._stops import check_end

PULSE_S = 0.15
REST_S = 0.3
SHARE = 0.6
"""Of the supply, or of the plan's highest voltage where that is less."""
TRIES = 3
"""Times that the pulses are run where the line loses samples of them."""
MOST_LOST = 0.2
"""Of a pulse's samples: with more the count may have moved unseen."""
LEAST = 5
"""Counts that a turning motor makes in a pulse."""


@dataclasses.dataclass(frozen=True)
class Pulse:
    """What the count did from the pulse to the end of the rest after it."""

    counts: tuple[int, ...]
    speed_counts_s: float = 0.0
    """At the end of the pulse."""

    @property
    def turned(self) -> int:
        """Counts."""
        return self.counts[-1] - self.counts[0]

    @property
    def wandered(self) -> int:
        """Counts between the extremes."""
        return max(self.counts) - min(self.counts)


def wiring_slots(rig: Rig, largest_V: float) -> tuple[Slot, ...]:
    """A pulse forward, a pulse backward, each with the shaft at rest before and after."""
    volts = min(SHARE * rig.supply_V, largest_V or rig.supply_V)
    pulse, rest = round(PULSE_S / rig.period_s), round(REST_S / rig.period_s)
    level = rig.level(volts)
    steps = (Slot("step", rest, pulse, (0, sign * level, 0), {}) for sign in (1, -1))
    return (*steps, Slot("rest", 0, rest, (0, 0, 0), {}))


def check_wiring(session: Session, rig: Rig, largest_V: float, no_load_rad_s: float | None) -> list[str]:
    """Run the pulses and judge them; what may be wrong but does not stop a recording.

    **Raises:** `RecorderError`, what to change, where a recording would be worthless.
    """
    log = _received(session, wiring_slots(rig, largest_V), rig)
    pulses = [_pulse(log, segment, rig) for segment in (1, 3)]
    faults = list(wiring_faults(pulses[0], pulses[1]))
    if faults:
        raise RecorderError(f"{session.port.name}: wiring: {' '.join(faults)} (--no-check records all the same)")
    volts = min(SHARE * rig.supply_V, largest_V or rig.supply_V)
    return list(wiring_notes(pulses[0], pulses[1], log.illegal, rig, volts, no_load_rad_s))


def _received(session: Session, slots: tuple[Slot, ...], rig: Rig) -> RunLog:
    """What came of the pulses; run again where the line has lost too much of them to judge by."""
    lost = [0]
    for _ in range(TRIES):
        log = RunLog(layout(slots, [slot.kind for slot in slots]), 0, session.start(slots))
        for message in itertools.chain.from_iterable(session.messages()):
            log.feed(message)
        session.account(log)
        check_end(session, log)
        lost = [piece.lost for piece in log.pieces.values()]
        if log.accounted and max(lost) <= MOST_LOST * PULSE_S / rig.period_s:
            return log
    raise RecorderError(f"{session.port.name}: wiring: {sum(lost)} samples of the pulses were lost; check the cable")


def wiring_faults(forward: Pulse, backward: Pulse) -> Iterator[str]:
    """What makes a recording worthless."""
    turned = abs(forward.turned) >= LEAST, abs(backward.turned) >= LEAST
    if not any(turned):
        if max(forward.wandered, backward.wandered) > 0:
            yield (
                "the count moves to and fro by one or two only: one of the encoder's two phases is missing; check the "
                "wires at D2 and D3 (which of the two cannot be told)."
            )
        else:
            yield (
                "no count came. If the shaft turned, the encoder is dead: check its supply, its ground and both phases "
                "(D2, D3). If it stood still: check VM, STBY, the motor's leads, and that nothing blocks it."
            )
    elif not all(turned):
        which = "forward (D9, AIN1)" if not turned[0] else "backward (D10, AIN2)"
        yield f"the motor turns one way only; nothing came of the pulse {which}: check that wire and the bridge."
    elif forward.turned < 0 < backward.turned:
        yield (
            "the count runs against the voltage: either the motor's two leads are swapped or the encoder's two phases "
            "(D2, D3). The first pulse was forward: if the shaft turned the way you call forward swap the phases, else "
            "swap the leads."
        )
    elif (forward.turned > 0) == (backward.turned > 0):
        yield (
            "the count goes the same way for both pulses: something outside turns the shaft, or one input of the "
            "bridge is not connected; check D9, D10 and the load."
        )


def wiring_notes(
    forward: Pulse, backward: Pulse, illegal: int, rig: Rig, volts: float, no_load_rad_s: float | None
) -> Iterator[str]:
    """What does not stop a recording."""
    if illegal:
        yield (
            f"{illegal} illegal encoder transitions in two pulses: shield the encoder's wires, or keep them away from "
            "the motor's"
        )
    small, large = sorted((abs(forward.turned), abs(backward.turned)))
    if large > 2 * small:
        yield f"one way the shaft turned {large} counts and the other {small}: is there a load, or friction?"
    if no_load_rad_s is None:
        return
    expected = no_load_rad_s * volts / rig.supply_V * rig.counts_per_rev / 6.283185307179586
    ratio = max(abs(forward.speed_counts_s), abs(backward.speed_counts_s)) / expected
    for factor in (4, 2, 0.5, 0.25):
        if abs(ratio / factor - 1) < 0.2:
            yield (
                f"the shaft seems {factor:g} times as fast as the data sheet says: counts_per_rev = "
                f"{rig.counts_per_rev:g} may be wrong by that factor (all four edges are counted)"
            )


def _pulse(log: RunLog, segment: int, rig: Rig) -> Pulse:
    during, after = log.pieces[segment], log.pieces[segment + 1]
    first = len(during) * 2 // 3
    ticks = max(during.tick[-1] - during.tick[first], 1)
    speed = (during.count[-1] - during.count[first]) / (ticks * rig.period_s)
    return Pulse((*during.count, *after.count), speed)
