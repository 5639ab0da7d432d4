"""A quantised recording of a known motor, with a name that tries every escape."""

import numpy as np

from jaxmotor.recording import Recording, Segment

GAIN, POLE, PERIOD, COUNTS, SUPPLY = 11.0, 40.0, 0.005, 617.4, 7.4
AWKWARD = "$\\frac{ 50 % \\alpha_ 电机 \x07 \ud800 \\"


class Rig:
    """An exactly sampled motor behind a bridge of 255 duties, read by an encoder."""

    def __init__(self, offset_V: float = 0.02):
        self.angle, self.begin, self.offset_V = 0.0, 0.0, offset_V
        self.segments: list[Segment] = []

    def record(self, kind: str, wanted: np.ndarray, **parameters) -> None:
        duty = np.rint(255 * wanted / SUPPLY).astype(np.int64)
        volts = duty * SUPPLY / 255
        tick = np.arange(len(volts))
        count = np.floor(self._turn(volts) * COUNTS / (2 * np.pi) + 0.37).astype(np.int64)
        time = tick * PERIOD
        self.segments.append(
            Segment(kind, self.begin, True, parameters, time, volts, tick=tick, duty=duty, count=count)
        )
        self.begin += time[-1] + 1.0

    def _turn(self, volts: np.ndarray) -> np.ndarray:
        kept = np.exp(-POLE * PERIOD)
        mean = (1 - kept) / (POLE * PERIOD)
        angle, speed = [], 0.0
        for u in volts + self.offset_V:
            angle.append(self.angle)
            self.angle += PERIOD * (mean * speed + GAIN * (1 - mean) * u)
            speed = kept * speed + GAIN * (1 - kept) * u
        return np.array(angle)


def made_recording(header: dict) -> Recording:
    rig = Rig()
    time = np.arange(600) * PERIOD
    for number, nominal in enumerate(np.geomspace(0.5, 10.0, 6)):
        frequency = float(nominal * (1 + 0.0037 * (-1) ** number))
        rig.record("sine", 5.1 * np.sin(2 * np.pi * frequency * time), frequency_Hz=frequency, amplitude_V=5.1)
    for volts in (5.1, -3.0, 5.1):
        rig.record("step", np.where(np.arange(200) < 4, 0.0, volts), amplitude_V=volts)
    return Recording(tuple(rig.segments), "folder/made.csv", PERIOD, COUNTS, 255.0, SUPPLY, "brake", header=header)
