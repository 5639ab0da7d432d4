"""Numbers as C's integers: products of a 32-bit value and a constant, without a float and without an overflow.

    times16(x, m) = x m / 2^16, rounded,    abs(x) < 2^30, abs(m) < 2^15

A constant v is m 2^e / 2^16 with 2^14 <= abs(m) < 2^15, so it is right to 3e-5; powers of two do the rest.
"""

import math

LARGEST = 2**30
TIMES16 = """\
// x m / 2^16, rounded. abs(x) < 2^30. Two 16-bit products: about 60 cycles on an AVR.
static inline int32_t
motor_times16(int32_t x, int16_t m)
{
    return (int32_t)(int16_t)(x >> 16) * m + (((int32_t)(uint16_t)x * m + 32768) >> 16);
}
"""


def times(name: str, value: float, largest: float | int) -> str:
    """C for `name` times `value`, where abs(`name`) <= `largest`.

    **Raises:** `OverflowError` where the product does not fit into 30 bits.
    """
    if value == 0:
        return "0"
    if largest * abs(value) >= LARGEST or largest >= LARGEST:
        raise OverflowError(f"{name} times {value:g} does not fit into 30 bits")
    exponent = math.frexp(abs(value))[1] + 1  # value = mantissa 2^exponent with 1/4 <= mantissa < 1/2
    mantissa = round(value * 2.0 ** (16 - exponent))
    if abs(mantissa) == 2**15:
        mantissa, exponent = mantissa // 2, exponent + 1
    if exponent > 0 and largest * 2.0**exponent < LARGEST:
        return f"motor_times16({name} * {2**exponent}, {mantissa})"
    if exponent > 0:
        return f"motor_times16({name}, {mantissa}) * {2**exponent}"
    if exponent == 0:
        return f"motor_times16({name}, {mantissa})"
    if exponent < -30:
        return "0"
    return f"((motor_times16({name}, {mantissa}) + {2 ** (-exponent - 1)}) >> {-exponent})"


def whole(value: float) -> str:
    """The nearest integer as a C constant."""
    return str(round(value))


def comment(text: str) -> str:
    """`text` of a recording as it may stand in a comment, and not too long."""
    return ascii_line(text)[:100]


def ascii_line(text: str) -> str:
    """`text` as it may stand in a C comment of one line: printable ASCII, no backslash, no question mark."""
    return "".join(c if " " <= c <= "~" and c not in "\\?" else "_" for c in text)
