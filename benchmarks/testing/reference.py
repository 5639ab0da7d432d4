"""The board's experiments and speed loop, in Python integers: what docs/protocol.md says, written a second time."""

import itertools
import math

FULL_SCALE = 250
_QUARTER = [round(32767 * math.sin(2 * math.pi * k / 256)) for k in range(65)]
PRBS_TAPS = {5: 3, 6: 5, 7: 6, 9: 5, 10: 7, 11: 9, 15: 14}


def sine(phase: int) -> int:
    """32767 sin of a phase in 1/65536 turn."""
    within = phase & 0x3FFF
    if phase & 0x4000:
        within = 0x4000 - within
    step, rest = within >> 8, within & 0xFF
    value = _QUARTER[step]
    if step < 64:
        value += ((_QUARTER[step + 1] - value) * rest) >> 8
    return -value if phase & 0x8000 else value


def clip(x: int, limit: int) -> int:
    return max(-limit, min(limit, x))


def divide(a: int, b: int) -> int:
    """As C does: towards zero."""
    return abs(a) // abs(b) * (1 if (a < 0) == (b < 0) else -1)


def step(ticks, a, b, c):
    return [(b + 64) >> 7] * ticks


def rest(ticks, a, b, c):
    return [0] * ticks


def ramp(ticks, a, b, c):
    value, slope = b << 14, divide((c - b) << 14, ticks)
    return [(value + k * slope + (1 << 20)) >> 21 for k in range(ticks)]


def _swept(ticks, increment, slope, amplitude, offset):
    duties, phase = [], 0
    for _ in range(ticks):
        duties.append((amplitude * sine(phase >> 16) + (offset << 15) + (1 << 21)) >> 22)
        phase = (phase + increment) % 2**32
        increment = (increment + slope) % 2**32
    return duties


def sine_wave(ticks, a, b, c):
    return _swept(ticks, a, 0, b, c)


def chirp(ticks, a, b, c):
    return _swept(ticks, a, b, c, 0)


def multisine(ticks, a, b, c):
    tones, stride = c & 0xFF, c >> 8
    phases = [-(k * (k + 1) * 32768 // tones) for k in range(tones)]
    duties = []
    for tick in range(ticks):
        total = sum(sine(((a * (1 + k * stride) * tick >> 16) + phases[k]) & 0xFFFF) for k in range(tones))
        duties.append(clip((b * (total >> 3) + (1 << 18)) >> 19, FULL_SCALE))
    return duties


def prbs(ticks, a, b, c):
    order, hold = a & 0xFF, a >> 8 & 0xFF
    bits, duties = 2**order - 1, []
    while len(duties) < ticks:
        duties += [((c + b if bits & 1 else c - b) + 64) >> 7] * hold
        bit = (bits >> order - 1 ^ bits >> PRBS_TAPS[order] - 1) & 1
        bits = (bits << 1 | bit) & 2**order - 1
    return duties[:ticks]


def loop(counts, a, b):
    """The duties for the counts that came; `counts[0]` is the count one sample before the first."""
    kp, ki, integral, duties = a & 0xFFFF, a >> 16, 0, []
    for before, now in itertools.pairwise(counts):
        error = clip(b - 16 * (now - before), 8191)
        u = (kp * error + (integral >> 8) + 2048) >> 12
        duties.append(clip(u, FULL_SCALE))
        if not (u > FULL_SCALE and error > 0) and not (u < -FULL_SCALE and error < 0):
            integral = clip(integral + ki * error, FULL_SCALE << 20)
    return duties


EXPERIMENTS = {
    "rest": rest,
    "step": step,
    "ramp": ramp,
    "sine": sine_wave,
    "multisine": multisine,
    "chirp": chirp,
    "prbs": prbs,
}
