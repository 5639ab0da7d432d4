"""Numbers with their errors."""

import math

USELESS = 1e6
"""Times a value, from which its half-width only says that nothing is known of it."""


def with_error(value: float, error: float, unit: str) -> str:
    """`value ± 95 % half-width unit`, with as many digits as the error allows; `value unit (not determined)` where the
    half-width is more than `USELESS` times the value."""
    half = 1.96 * error
    if math.isnan(half) or half <= 0:
        return f"{value:.6g} {unit}".rstrip()
    if math.isinf(half) or half > USELESS * abs(value) > 0:
        return f"{value:.3g} {unit}".rstrip() + " (not determined)"
    digits = _digits(half)
    if digits > 12:
        return f"{value:.6g} ± {half:.1e} {unit}".rstrip()
    return f"{value:.{digits}f} ± {half:.{digits}f} {unit}".rstrip()


def if_determined(value: float, error: float, unit: str) -> str:
    """As `with_error`; an interval that holds zero says little of its middle, a far wider one nothing."""
    if 1.96 * error < abs(value):
        return with_error(value, error, unit)
    return "not determined" + (f" ({with_error(value, error, unit)})" if error < 5 * abs(value) else "")


def as_known(value: float, error: float, unit: str) -> str:
    """`value unit` with as many digits as `between` gives its limits."""
    half = 1.96 * error
    if math.isinf(half):
        return f"{value:.3g} {unit}".rstrip()
    if math.isnan(half) or half <= 0 or half < 1e-12 * abs(value):
        return f"{value:.6g} {unit}".rstrip()
    return f"{value:.{_digits(half)}f} {unit}".rstrip()


def between(value: float, error: float, unit: str) -> str:
    """The 95 % interval of `value`."""
    half = 1.96 * error
    if not math.isfinite(half):
        return "not known"
    if half <= 0 or half < 1e-12 * abs(value):
        return f"{value:.6g} {unit}".rstrip()
    digits = _digits(half)
    return f"{value - half:.{digits}f} to {value + half:.{digits}f} {unit}".rstrip()


def _digits(half: float) -> int:
    """Behind the point, of which an interval of this half width shows two."""
    return max(0, 1 - math.floor(math.log10(half)))


def voltage(value: float) -> str:
    """`value` [V] for people: in mV below 1 V."""
    return f"{1e3 * value:.3g} mV" if abs(value) < 0.9995 else f"{value:.3g} V"


def bracket(interval: tuple[float, float, float], digits: int = 3) -> str:
    """` [low, high]` of (value, low, high), to stand behind the value, with so many digits or as many as tell the ends
    apart; nothing where the interval has no width."""
    for more in range(digits, digits + 4):
        low, high = (f"{end:.{more}g}" for end in interval[1:])
        if low != high:
            return f" [{low}, {high}]"
    return ""


def with_bracket(interval: tuple[float, float, float], factor: float = 1.0) -> str:
    """`value [low, high]` of (value, low, high) times `factor`; without the limits where these are not known."""
    value, low, high = (factor * number for number in interval)
    if not (math.isfinite(low) and math.isfinite(high)):
        return plainly(value, 4)
    return f"{value:.4g}{bracket((value, low, high), 4)}"


def plainly(value: float, digits: int = 3) -> str:
    """`value` without a power of ten where that can be."""
    if not math.isfinite(value):
        return "not known"
    return f"{value:.0f}" if 10**digits <= abs(value) < 1e7 else f"{value:.{digits}g}"
