"""Makes the bundled recording of a linear motor anew (seconds): the paper's experiments on a plant, without a board.

Sines of 5.1 V to 10 Hz (detuned by a few tenths of a percent, so that the encoder does not repeat itself), ten steps,
and five runs of the proportional speed loop, at a period of 5 ms. A test holds that the
bytes are the same.
"""

import dataclasses
from pathlib import Path

import numpy as np
from testing.plain_plant import Plant, close_loop, drive

import jaxmotor
from jaxmotor.recording import Recording, Segment, write

PERIOD_S = 0.005
SUPPLY_V = 7.4
FULL_SCALE = 255
AMPLITUDE_V = 5.1
FREQUENCIES_HZ = (0.503, 1.007, 2.009, 3.011, 4.013, 5.017, 6.019, 7.023, 8.027, 9.029, 10.031)
REFERENCE_RAD_S = 37.7
LOOP_GAIN_V_S = 0.4
PAUSE_S = 0.5


def paper_recording(plant: Plant, seed: int = 0) -> Recording:
    """All experiments in a row; the motor rests between them. `seed` draws where the shaft stands at the start."""
    plant = dataclasses.replace(plant, encoder_offset=float(np.random.default_rng(seed).uniform()))
    segments: list[Segment] = []

    def add(kind: str, parameters: dict, duty: np.ndarray, count: np.ndarray) -> None:
        start = segments[-1].start_s + len(segments[-1]) * PERIOD_S + PAUSE_S if segments else 0.0
        tick = np.arange(len(duty))
        volts = duty / FULL_SCALE * SUPPLY_V
        segments.append(
            Segment(kind, round(start, 3), True, parameters, tick * PERIOD_S, volts, tick=tick, duty=duty, count=count)
        )
        plant.stop()

    for frequency in FREQUENCIES_HZ:
        duty = _duty(AMPLITUDE_V * np.sin(2 * np.pi * frequency * np.arange(800) * PERIOD_S))
        parameters = {"frequency_Hz": frequency, "amplitude_V": AMPLITUDE_V}
        add("sine", parameters, duty, drive(plant, duty, SUPPLY_V / FULL_SCALE, PERIOD_S))
    for _ in range(10):
        duty = _duty(np.full(120, AMPLITUDE_V))
        add("step", {"amplitude_V": AMPLITUDE_V}, duty, drive(plant, duty, SUPPLY_V / FULL_SCALE, PERIOD_S))
    for _ in range(5):
        parameters = {"reference_rad_s": REFERENCE_RAD_S, "gain": LOOP_GAIN_V_S}
        loop = close_loop(plant, 160, PERIOD_S, REFERENCE_RAD_S, LOOP_GAIN_V_S, SUPPLY_V, FULL_SCALE)
        add("closed_loop", parameters, *loop)
    return Recording(
        tuple(segments),
        "linear.csv",
        period_s=PERIOD_S,
        counts_per_rev=plant.counts_per_rev,
        duty_full_scale=float(FULL_SCALE),
        supply_V=SUPPLY_V,
        drive="brake",
        header={
            "motor": "simulated, linear, after the paper's Pololu 51.45:1",
            "rig": "no board: a plant integrated in Euler steps of 10 us (benchmarks/testing/plain_plant.py)",
            "notes": f"gain {plant.gain:.6g} rad/s/V, pole {plant.pole:.6g} rad/s, "
            f"L/R {1e6 * plant.inductance_H / plant.resistance_ohm:.4g} us, no friction",
        },
    )


def _duty(volts: np.ndarray) -> np.ndarray:
    return np.rint(volts / SUPPLY_V * FULL_SCALE).astype(np.int64)


if __name__ == "__main__":
    path = Path(jaxmotor.__file__).parent / "recording" / "bundled" / "linear.csv"
    path.parent.mkdir(exist_ok=True)
    write(paper_recording(Plant()), path)
    print(path)
