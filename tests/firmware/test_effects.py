"""Every effect of the vocabulary, and those outside it, hidden behind the real firmware."""

import pytest
from testing.wire import Script, hertz, level

EFFECTS = {
    "transport_delay": "delay_s = 0.003",
    "dead_zone": "volts_V = 0.4",
    "input_threshold": "volts_V = 0.8",
    "voltage_offset": "volts_V = 0.1",
    "voltage_saturation": "volts_V = 4.0",
    "direction_asymmetry": "ratio = 0.05",
    "supply_sag": "ratio = 0.1",
    "supply_drift": "rate_per_s = 0.01",
    "coast_drive": "",
    "current_limit": "volts_V = 2.0",
    "electrical_pole": "time_constant_s = 0.002",
    "coulomb_friction": "volts_V = 0.3",
    "stiction": "volts_V = 0.2\nstatic_volts_V = 0.4\nstribeck_speed_rad_s = 2.0",
    "quadratic_drag": "volts_V_s2_rad2 = 3e-4",
    "cogging": "volts_V = 0.3\ncycles_per_rev = 6\nphase_rad = 0.4",
    "load_torque": "volts_V = 0.2",
    "winding_heating": "rise_ratio = 3.0\ntime_constant_s = 2.0",
    "shaft_compliance": "frequency_Hz = 15\ndamping_ratio = 0.05\ninertia_ratio = 0.4",
    "backlash": "gap_rad = 0.1\ninertia_ratio = 0.5",
    "encoder_eccentricity": "amplitude_rad = 0.05\ncycles_per_rev = 1\nphase_rad = 0.2",
    "missed_counts": "ratio = 0.05\nspeed_rad_s = 20",
    "sensor_lag": "time_constant_s = 0.01",
    "late_load": "start_s = 1.5\nvolts_V = 0.5",
    "outside_torque": "frequency_Hz = 3.3\nvolts_V = 0.4",
    "wandering_torque": "volts_V = 0.4\ntime_constant_s = 0.5",
}


def table(name: str) -> str:
    return f"[{name}]\n{EFFECTS[name]}\n"


@pytest.fixture
def script() -> bytes:
    s = Script().add("step", 150, b=level(170), rest=50).add("sine", 400, hertz(3.01, 0.005), level(150), rest=50)
    return bytes(s.go())


@pytest.mark.parametrize("name", EFFECTS)
def test_each_alone_shows_in_the_log(bench, script, name):
    plain, hidden = bench(script), bench(script, plant=table(name))
    assert hidden.end == "done"
    a, b = ([line.ints() for line in outcome.of("D")] for outcome in (plain, hidden))
    assert [row[:3] for row in a] == [row[:3] for row in b]  # the host set the same duties
    assert max(abs(x[3] - y[3]) for x, y in zip(a, b, strict=True)) >= 3


def test_all_together(bench, script):
    plant = "".join(table(name) for name in EFFECTS)
    outcome = bench(script, plant=plant)
    assert outcome.end == "done"
    assert outcome.raw == bench(script, plant=plant).raw
