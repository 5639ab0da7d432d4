"""Plans: experiments one after the other, as a TOML file says them, checked before a motor moves.

    name = "mine"
    period_ms = 5              # of the samples
    drive = "brake"            # or "coast": the bridge between pulses
    supply_V = 7.4             # as measured; left out, the board measures it
    counts_per_rev = 617.4     # left out, the board's own
    rest_s = 0.3               # standing still before each experiment
    detune = true              # move sines by 0.2 to 0.4 %
    [[experiment]]
    kind = "sine"
    frequency_Hz = [0.5, 1, 2]
    amplitude_V = 5.1
    duration_s = 4

A list makes one experiment of each of its values, and `repeat = 10` ten of each.
"""

import dataclasses
import itertools
import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NoReturn

from jaxmotor._errors import JaxmotorError
from jaxmotor._files import read_bytes
from jaxmotor._sentences import one_of, shown
from jaxmotor.recording import RecordingError
from jaxmotor.recording._parse_toml import parse_toml
from jaxmotor.recording._text import MAX_ROWS, text_of

FOLDER = Path(__file__).parent / "plans"
BUILT_IN = ("paper", "full")
MAX_TICKS = 65535
"""Of one experiment, and of the rest before it."""
MAX_BYTES = 1_000_000
MAX_EXPERIMENTS = 10_000
"""With their repetitions, each value of a list counted; boards take fewer."""
MAX_NAME, MAX_TEXT = 100, 10_000
"""Characters of the plan's name, and of a note."""
LARGEST = 1e9
"""No number of a plan is greater, in whatever unit, ..."""
SMALLEST = 1e-9
"""...or nearer to 0 without being 0."""
Value = float | int

NEEDED = {
    "sine": {"frequency_Hz", "amplitude_V"},
    "multisine": {"first_Hz", "tones", "amplitude_V"},
    "chirp": {"from_Hz", "to_Hz", "amplitude_V"},
    "prbs": {"amplitude_V"},
    "step": {"amplitude_V"},
    "ramp": {"from_V", "to_V"},
    "closed_loop": {"reference_rad_s", "gain"},
    "rest": set(),
}
"""What each kind of experiment must state."""
OPTIONAL = {
    "sine": {"offset_V": 0.0},
    "multisine": {"stride": 1},
    "prbs": {"offset_V": 0.0, "order": 9, "hold_ticks": 4},
    "closed_loop": {"integral_gain": 0.0},
}
"""What each kind may state, and what holds otherwise."""
_WHOLE = {"tones", "stride", "order", "hold_ticks", "repeat"}
_COMMON = {"kind", "duration_s", "periods", "rest_s", "repeat"}
_TEXTS = ("motor", "rig", "notes")
_TOP = {"name", "period_ms", "drive", "supply_V", "counts_per_rev", "rest_s", "detune", "travel_rev", "supply_min_V"}
_TOP |= {"no_load_rad_s", "experiment", *_TEXTS}


class PlanError(JaxmotorError):
    """A plan that cannot be run, and what to change."""


@dataclasses.dataclass(frozen=True)
class Experiment:
    """One experiment and the rest before it."""

    kind: str
    """As in a recording's `[[segment]]`."""
    ticks: int
    rest_ticks: int
    parameters: Mapping[str, Value]
    """SI, as the plan states them, frequencies detuned."""


@dataclasses.dataclass(frozen=True)
class Plan:
    """Experiments in order, and the rig that they are for."""

    name: str
    period_ms: int
    experiments: tuple[Experiment, ...]
    drive: str = "brake"
    supply_V: float | None = None
    """As measured; None = what the board measures."""
    counts_per_rev: float | None = None
    """None = what the board says."""
    travel_rev: float | None = None
    """The motor stops when the shaft is farther from its start [1]."""
    supply_min_V: float | None = None
    """The motor stops below; None = the board's own limit."""
    no_load_rad_s: float | None = None
    """The motor's speed at the whole supply by its data sheet, to check the counts per turn against [rad/s]."""
    header: Mapping[str, str] = dataclasses.field(default_factory=dict)
    """`motor`, `rig`, `notes` for the recording."""

    @property
    def ticks(self) -> int:
        """Of all experiments and rests."""
        return sum(experiment.rest_ticks + experiment.ticks for experiment in self.experiments)

    @property
    def period_s(self) -> float:
        """Of the samples [s]."""
        return self.period_ms / 1000

    @property
    def seconds(self) -> float:
        """Of all experiments and rests [s]."""
        return self.ticks * self.period_s

    @property
    def largest_V(self) -> float:
        """The highest voltage that any experiment states, 0 where none does."""
        stated = (
            abs(e.parameters.get(key, 0.0)) for e in self.experiments for key in ("amplitude_V", "from_V", "to_V")
        )
        return max(stated, default=0.0)


def load_plan(name: str | Path, *, whole_hertz: bool = False) -> Plan:
    """The built-in plan `name`, or the one in the TOML file of that name. `whole_hertz` leaves frequencies as stated.

    **Raises:** `PlanError`.
    """
    path = FOLDER / f"{name}.toml" if str(name) in BUILT_IN else Path(name)
    if not os.path.lexists(path):
        raise PlanError(
            f"{name}: there is no such plan; name a TOML file, or one of the built-in plans {' and '.join(BUILT_IN)}"
        )
    data = read_bytes(path, MAX_BYTES, "a plan", "a plan is a short TOML file", PlanError)
    try:
        text = text_of(data, str(name))
    except RecordingError as error:
        raise PlanError(str(error)) from error
    return parse_plan(text, str(name), whole_hertz=whole_hertz)


def parse_plan(text: str, source: str, *, whole_hertz: bool = False) -> Plan:
    """The plan in `text`, TOML of the file `source`.

    **Raises:** `PlanError`.
    """
    try:
        table = parse_toml(text, source, "the plan")
    except RecordingError as error:
        raise PlanError(str(error)) from error
    return _Reader(source).plan(table, whole_hertz)


class _Reader:
    """Turns tables into a plan; every complaint names the file and the experiment."""

    def __init__(self, source: str) -> None:
        self.where = source

    def plan(self, table: dict[str, Any], whole_hertz: bool) -> Plan:
        self.unknown(table, _TOP)
        period = self.period(table.get("period_ms", 5))
        drive = table.get("drive", "brake")
        if drive not in ("brake", "coast"):
            self.fail(f"drive = {shown(drive)} is not known; it is 'brake' or 'coast'")
        rest_s = self.number(table, "rest_s", 0.3, least=0.0)
        detune = self.truth(table, "detune") and not whole_hertz
        source, tables = self.where, table.get("experiment", [])
        optional = {
            key: self.number(table, key, 0.0) if key in table else None
            for key in ("supply_V", "counts_per_rev", "travel_rev", "supply_min_V", "no_load_rad_s")
        }
        header = {key: self.text(table[key], key) for key in _TEXTS if key in table}
        name = self.text(table.get("name", Path(source).stem[:MAX_NAME]), "name", MAX_NAME)
        if not isinstance(tables, list) or not tables or not all(isinstance(item, dict) for item in tables):
            self.fail("the plan has no experiments; add [[experiment]] with a kind and a duration_s")
        experiments: list[Experiment] = []
        ticks = 0
        for index, item in enumerate(tables):
            self.where = f"{source}: experiment {index}"
            before = len(experiments)
            experiments += self.experiments(item, period, rest_s, detune, MAX_EXPERIMENTS - len(experiments))
            ticks += sum(experiment.rest_ticks + experiment.ticks for experiment in experiments[before:])
            if ticks > MAX_ROWS:
                self.fail(f"with this the plan has more than the {MAX_ROWS} samples of a recording; shorten it")
        return Plan(name, period, tuple(experiments), drive, header=header, **optional)

    def period(self, value: Any) -> int:
        if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= 20:
            self.fail(f"period_ms = {shown(value)} is not a whole number from 1 to 20")
        return value

    def experiments(
        self, table: dict[str, Any], period_ms: int, rest_s: float, detune: bool, most: int
    ) -> list[Experiment]:
        kind = table.get("kind")
        if not isinstance(kind, str) or kind not in NEEDED:
            self.fail(f"kind = {shown(kind)} is not known; it is one of {', '.join(NEEDED)}")
        defaults: dict[str, Any] = OPTIONAL.get(kind, {})
        self.unknown(table, _COMMON | NEEDED[kind] | set(defaults))
        for key in sorted(NEEDED[kind] - set(table)):
            self.fail(f"a {kind} needs {key}")
        repeat = self.whole(table, "repeat", 1)
        rest = self.ticks(self.number(table, "rest_s", rest_s, least=0.0), period_ms, "rest_s")
        names = sorted(NEEDED[kind] | set(defaults))
        number = repeat * math.prod(len(table[name]) if isinstance(table.get(name), list) else 1 for name in names)
        if number > most:
            self.fail(f"with these {number} experiments the plan has more than {MAX_EXPERIMENTS}; shorten its lists")
        choices = [self.values(table, name, defaults.get(name)) for name in names]
        made = [self.one(kind, dict(zip(names, c, strict=True)), table, period_ms) for c in itertools.product(*choices)]
        made = [
            Experiment(kind, ticks, 0 if rest == 1 else rest, _detuned(parameters, index) if detune else parameters)
            for index, (ticks, parameters) in enumerate(made)
        ]
        highest = max((e.parameters.get("frequency_Hz", 0.0) for e in made), default=0.0)
        if highest >= 500 / period_ms:
            self.fail(f"frequency_Hz = {highest:g}, detuned, is not below the Nyquist frequency; lower it")
        return [experiment for experiment in made for _ in range(repeat)]

    def one(
        self, kind: str, parameters: dict[str, Value], table: dict[str, Any], period_ms: int
    ) -> tuple[int, dict[str, Value]]:
        for key, value in parameters.items():
            if key.endswith("_Hz") and not 0 < value < 500 / period_ms:
                self.fail(f"{key} = {value:g} is not between 0 and the Nyquist frequency of {500 / period_ms:g} Hz")
        if parameters.get("amplitude_V") == 0:
            self.fail("amplitude_V is 0; a rest is of kind 'rest'")
        seconds = self.number(table, "duration_s", 0.0) if "duration_s" in table else 0.0
        if "periods" in table:
            if kind != "sine":
                self.fail(f"periods belong to a sine; give a {kind} its duration_s")
            seconds = max(seconds, self.number(table, "periods", 0.0) / parameters["frequency_Hz"])
        if not seconds:
            self.fail("give it a duration_s")
        ticks = self.ticks(seconds, period_ms, "duration_s")
        if ticks < 2:
            self.fail(f"{seconds:g} s are less than two samples of {period_ms} ms")
        return ticks, parameters

    def ticks(self, seconds: float, period_ms: int, key: str) -> int:
        ticks = math.floor(seconds * 1000 / period_ms + 0.5)
        if ticks > MAX_TICKS:
            self.fail(f"{key} = {seconds:g} s is more than the board's {MAX_TICKS * period_ms / 1000:g} s; split it")
        return ticks

    def values(self, table: dict[str, Any], key: str, default: Any) -> list[Value]:
        given = table.get(key, default)
        if isinstance(given, list) and not given:
            self.fail(f"{key} is an empty list")
        items = given if isinstance(given, list) else [given]
        if key in _WHOLE:
            return [self.whole({key: item}, key, 1) for item in items]
        return [self.number({key: item}, key, 0.0) for item in items]

    def number(self, table: dict[str, Any], key: str, default: float, least: float | None = None) -> float:
        value = table.get(key, default)
        signed = key.endswith(("_V", "rad_s")) or key == "gain" or key == "integral_gain"
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            self.fail(f"{key} = {shown(value)} is not a number")
        if abs(value) > LARGEST or 0 < abs(value) < SMALLEST:
            self.fail(f"{key} = {value:g} is more than {LARGEST:g} or less than {SMALLEST:g}; check its unit")
        if least is not None and value < least:
            self.fail(f"{key} = {value:g} is less than {least:g}")
        positive_key = key in ("supply_V", "supply_min_V", "no_load_rad_s")
        if least is None and (positive_key or not signed) and value <= 0:
            self.fail(f"{key} = {value:g} is not positive")
        return float(value)

    def whole(self, table: dict[str, Any], key: str, default: int) -> int:
        value = table.get(key, default)
        if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= 10_000:
            self.fail(f"{key} = {shown(value)} is not a whole number from 1 to 10000")
        return value

    def truth(self, table: dict[str, Any], key: str) -> bool:
        value = table.get(key, False)
        if not isinstance(value, bool):
            self.fail(f"{key} = {shown(value)} is not true or false")
        return value

    def text(self, value: Any, key: str, longest: int = MAX_TEXT) -> str:
        if not isinstance(value, str):
            self.fail(f"{key} is text; put it in quotes")
        if len(value) > longest:
            self.fail(f"{key} has {len(value)} characters, more than {longest}; shorten it")
        return value

    def unknown(self, table: dict[str, Any], known: set[str]) -> None:
        for key in table:
            if key not in known:
                self.fail(f"{shown(key)[1:-1]} is not known here; it is one of {one_of(sorted(known), key)}")

    def fail(self, sentence: str) -> NoReturn:
        raise PlanError(f"{self.where}: {sentence}")


def _detuned(parameters: dict[str, Value], index: int) -> dict[str, Value]:
    """Frequencies raised by 0.2 to 0.4 %, each by another share, so that no two stay whole multiples."""
    share = 0.002 + 0.002 * (index * 0.6180339887 % 1)
    return {
        key: float(f"{value * (1 + share):.6g}") if key == "frequency_Hz" else value
        for key, value in parameters.items()
    }
