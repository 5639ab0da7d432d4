"""The plant library itself: its files, its sentences, the same bits from any compiler, and the board's loop."""

import subprocess
from pathlib import Path

import numpy as np
import pytest
from plant_cases import MEAN
from testing import reference
from testing.plant import Plant, load

pytestmark = pytest.mark.usefixtures("plant_library")
EMULATOR = Path(__file__).parents[2] / "firmware" / "emulator"


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("[friction]\n", "line 1: no effect or part is called [friction]"),
        ("[cogging]\nvolts_V = 1\n", "[cogging] needs cycles_per_rev"),
        ("\n[dead_zone]\nvolt = 1\n", "line 3: [dead_zone] has no key volt"),
        ("[dead_zone]\nvolts_V = -1\n", "line 2: volts_V = -1 is out of range: 0 to 1000"),
        ("[dead_zone]\nvolts_V = much\n", "line 2: volts_V must be a number"),
        ("[dead_zone\n", "line 1: a table is written [name]"),
        ("[dead_zone]\nvolts_V\n", "line 2: expected key = value"),
        ("[dead_zone]\nvolts_V = 1 2\n", "line 2: volts_V must be a number"),
        ("[bench]\nstep_s = 1e-3\n", "line 2: step_s = 0.001 is out of range: 1e-07 to 2e-05"),
        ("volts_V = 1\n", "line 1: volts_V stands in no [table]"),
        ("[\x1b[31mx]\n", "line 1: no effect or part is called [?[31mx]"),
        ("[dead_zone]\nvolts_V = \x1b\xff\n", "line 2: volts_V must be a number"),
        (
            "[motor]\npole_rad_s = 9223372036854775808",
            "line 2: pole_rad_s = 9.22337e+18 is out of range: 0.001 to 10000",
        ),
        ("[motor]\npole_rad_s = nan\n", "line 2: pole_rad_s must be a number"),
        ("[motor]\ngain_rad_s_V = inf\n", "line 2: gain_rad_s_V = inf is out of range: 0.001 to 100000"),
        (
            "[motor]\ninductance_H = 1e-9\n",
            "[motor] has an electrical time constant L/R of 2.22222e-10 s: 0, or 1e-6 to 10",
        ),
        (
            "[motor]\ntorque_constant_Nm_A = 1e-6\ninertia_kgm2 = 1e-3\n",
            "[motor] has a gain of 1e+06 rad/s/V: 0.001 to 1e5",
        ),
        (
            "[shaft_compliance]\nfrequency_Hz = 1e4\ndamping_ratio = 1\ninertia_ratio = 1e3\n",
            "the motor cannot be integrated: a spring, brake or source is too stiff for it",
        ),
    ],
)
def test_plant_files_that_do_not_fit(text, sentence):
    with pytest.raises(ValueError, match=r".") as raised:
        Plant(text)
    assert str(raised.value) == sentence


def test_a_plant_that_diverges_stands_still():
    """The torque from outside is small while the plant is tried, and grows a hundredfold."""
    torque = "[outside_torque]\nfrequency_Hz = 5e-3\nvolts_V = 1000\n"
    with Plant(MEAN + "[motor]\ngain_rad_s_V = 1e5\n[encoder]\ncounts_per_rev = 600\n" + torque) as p:
        count = p.sequence([0] * 800).count
    assert abs(count[200] - count[199]) > 1000 and count[-1] == count[-2]


def test_plant_file_with_all_that_is_allowed():
    with Plant('title = "a motor"  # note\n\n[motor]  # its own\n gain_rad_s_V = 12.0 # rad/s/V\n[coast_drive]\n') as p:
        assert p.linear.gain == pytest.approx(12)


EVERYTHING = """
[supply_sag]
ratio = 0.05
[stiction]
volts_V = 0.2
static_volts_V = 0.4
stribeck_speed_rad_s = 2.0
[cogging]
volts_V = 0.1
cycles_per_rev = 6
[winding_heating]
rise_ratio = 0.5
time_constant_s = 20
[encoder_eccentricity]
amplitude_rad = 0.02
cycles_per_rev = 1
[wandering_torque]
volts_V = 0.1
time_constant_s = 1
[shaft_compliance]
frequency_Hz = 25
damping_ratio = 0.05
inertia_ratio = 0.3
[transport_delay]
delay_s = 0.0007
"""


@pytest.mark.parametrize("flags", ["-O0", "-O3 -march=native"])
def test_the_compiler_changes_no_bit(tmp_path, excitation, flags):
    sources = [
        str(EMULATOR / f"{name}.c")
        for name in ("plant", "plant_make", "plant_read", "sequence", "effects", "toml", "maths")
    ]
    other = tmp_path / "libplant.so"
    command = ["cc", *flags.split(), "-ffp-contract=off", "-fPIC", "-shared", *sources, "-o", str(other), "-lm"]
    subprocess.run(command, check=True)
    with Plant(EVERYTHING) as p, Plant(EVERYTHING, load(other)) as q:
        a, b = p.sequence(excitation), q.sequence(excitation)
    assert np.array_equal(a.count, b.count)
    assert np.array_equal(a.speed, b.speed) and np.array_equal(a.angle, b.angle)


def test_closed_loop_is_the_boards():
    with Plant() as p:
        run = p.loop([16 * 19] * 300, 7000, 300)
    counts = [0, *run.count.tolist()]
    assert run.duty.tolist() == reference.loop(counts, 7000 + (300 << 16), 16 * 19)
