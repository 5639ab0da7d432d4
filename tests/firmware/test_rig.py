"""Board and plant together: what the log says is what the plant did with the logged duties."""

import numpy as np
import pytest
from testing.plant import BRAKE, COAST, Plant
from testing.wire import Script, hertz, level

FRICTION = "[coulomb_friction]\nvolts_V = 0.3\n"


def log_of(outcome):
    rows = np.array([line.ints()[:4] for line in outcome.of("D")])
    return rows[:, 2], rows[:, 3]


@pytest.fixture
def script():
    def write(period, drive):
        s = Script().command("U 500000").command(f"P {period} {drive}")
        s.add("step", 200, b=level(170), rest=20).add("sine", 500, hertz(7.003, period / 1000), level(200))
        s.add("prbs", 300, 9 + (5 << 8), level(200)).add("chirp", 300, hertz(1, 0.005), 500000, level(150))
        return bytes(s.add("loop", 200, 7000 + (300 << 16), 16 * 19).go())

    return write


@pytest.mark.parametrize("drive", [BRAKE, COAST])
@pytest.mark.parametrize("plant", ["", FRICTION])
@pytest.mark.parametrize("period", [1, 5, 20])
def test_log_is_what_the_plant_does(bench, script, drive, plant, period):
    duty, count = log_of(bench(script(period, drive), plant=plant))
    with Plant(plant) as p:
        run = p.sequence(duty, period_s=period / 1000, delay_s=40e-6, drive=drive)
    # The board latches a few us after the tick: at most one count, now and then.
    difference = count - run.count
    assert np.abs(difference).max() <= 1
    assert np.mean(difference != 0) < 0.05


def test_the_count_comes_first_then_the_duty(bench):
    """At the tick of a step's first duty the count is still that of the rest before it."""
    outcome = bench(bytes(Script().command("P 20 0").add("step", 50, b=level(250), rest=5).go()))
    first, second = outcome.samples(1)[:2]
    assert first == [0, 250, 0]
    with Plant() as p:
        expected = p.sequence([250, 250], period_s=0.02, delay_s=40e-6).count[1]
    assert second[2] == expected > 10


def test_decay_modes_differ_as_they_should(bench):
    def speed(drive):
        outcome = bench(bytes(Script().command(f"P 5 {drive}").add("step", 1500, b=level(50)).go()))
        counts = [count for _, _, count in outcome.samples(0)]
        return (counts[-1] - counts[-201]) / 617.4 * 2 * np.pi

    assert speed(BRAKE) == pytest.approx(10.6 * 7.4 * 0.2, rel=0.01)
    assert speed(COAST) > 2 * speed(BRAKE)


@pytest.mark.parametrize("drive", [BRAKE, COAST])
def test_both_directions_are_alike(bench, drive):
    def travel(duty):
        script = Script().command(f"P 5 {drive}").add("step", 200, b=level(duty)).go()
        return bench(bytes(script), plant="[encoder]\nstart_fraction = 0.5\n").samples(0)[-1][2]

    assert travel(120) == pytest.approx(-travel(-120), abs=1)


def test_motor_off_until_a_run(bench):
    """Standby: a load turns the shaft freely before the run, against a shorted winding after it."""
    plant = "[load_torque]\nvolts_V = -0.2\n"
    before = bench(b"H\n", "--until", "0.5", plant=plant).stats["plant"]["speed_rad_s"]
    script = bytes(Script().command("L 2000000 1000000 6000").add("rest", 10).go())
    after = bench(script, "--until", "2.5", plant=plant).stats["plant"]["speed_rad_s"]
    assert before > 10
    assert after == pytest.approx(0.2 * 10.6, rel=0.01)


def test_paper_values_from_the_emulated_bench(bench):
    """Gain from a step and pole from sines, within 1 % of the plant's own linear values."""
    period = 0.005
    script = Script().command("L 9000000 1000000 6000").add("step", 400, b=level(172))
    frequencies = [0.503, 1.007, 2.003, 4.007, 6.003, 8.009, 10.007]
    for frequency in frequencies:
        script.add("sine", 600, hertz(frequency, period), level(172), rest=100)
    outcome = bench(bytes(script.go()), plant="[motor]\ninductance_H = 0\n")
    samples = np.array(outcome.samples(0))
    gain = (samples[-1, 2] - samples[-201, 2]) / 617.4 * 2 * np.pi / (172 / 250 * 7.4)
    assert gain == pytest.approx(10.6, rel=0.01)
    errors = []
    for k, frequency in enumerate(frequencies):
        samples = np.array(outcome.samples(2 * k + 2))[100:]
        w = 2 * np.pi * frequency
        n = samples[:, 0]
        regressors = np.column_stack([np.cos(w * period * n), np.sin(w * period * n), np.ones(len(n))])
        u = np.linalg.lstsq(regressors, samples[:, 1] * 7.4 / 250, rcond=None)[0]
        v = np.linalg.lstsq(regressors[:-1], np.diff(samples[:, 2]) * 2 * np.pi / 617.4 / period, rcond=None)[0]
        errors.append((w, complex(v[0], -v[1]) / complex(u[0], -u[1])))

    def response(a, w):
        p, g, z = np.exp(-a * period), -np.expm1(-a * period) / (a * period), np.exp(1j * w * period)
        # The duty acts 40 us after the count.
        return gain * ((1 - g) + g * (1 - p) / (z - p)) * np.exp(-1j * w * 40e-6)

    poles = np.linspace(36, 44, 801)
    misfit = [sum(abs(h - response(a, w)) ** 2 for w, h in errors) for a in poles]
    assert poles[np.argmin(misfit)] == pytest.approx(40, rel=0.01)
