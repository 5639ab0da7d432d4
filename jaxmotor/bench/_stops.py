"""Why a run of the board ended early, in sentences."""

from jaxmotor.bench._log import RunLog
from jaxmotor.bench._protocol import RecorderError
from jaxmotor.bench._session import Session

REASONS = {
    "stopped": "the run was stopped",
    "host_silent": "the board received nothing from this computer for 250 ms and stopped the motor; is the computer "
    "overloaded, or the cable loose?",
    "time_limit": "the run took longer than planned, and the board stopped the motor",
    "travel_limit": "the shaft went beyond the travel limit; raise travel_rev in the plan, or free its way",
    "stalled": "the motor was driven and no count came for a second: the shaft is stuck, or the encoder came off",
    "low_supply": "the supply fell below its limit; charge the battery, or lower supply_min_V in the plan",
    "late": "the board could not keep up; make the experiments longer, or the period",
}


def check_end(session: Session, log: RunLog) -> None:
    """Whether the run came to its end.

    **Raises:** `RecorderError`, why not.
    """
    if log.reason == "done":
        return
    sentence = REASONS.get(log.reason, f"the board stopped the motor ({log.reason})")
    if not log.reason:
        sentence = "the board does not say how the run ended; check the cable"
    raise RecorderError(f"{session.port.name}: {sentence}")
