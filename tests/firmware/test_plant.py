"""The plant against the motor's equations: closed forms, scipy's linear systems, scipy's integrator."""

import math
import subprocess
from pathlib import Path

import numpy as np
import pytest
import reference
from plant import COAST, Plant, load
from scipy import integrate, linalg

MEAN = "[bench]\npwm_edges = false\n"
FIRST_ORDER = MEAN + "[motor]\ninductance_H = 0\n"
V, K, A, T = 7.4, 10.6, 40.0, 0.005
HALF = 125


pytestmark = pytest.mark.usefixtures("plant_library")
EMULATOR = Path(__file__).parents[2] / "firmware" / "emulator"


def steady_speed(plant: str, duty: int = HALF, drive: int = 0, ticks: int = 300) -> float:
    with Plant(plant) as p:
        return p.sequence([duty] * ticks, drive=drive).speed[-1]


def exact(plant: Plant, duty, period=T):
    """(speed, angle) of the linear motor with inductance: zero-order hold by matrix exponential."""
    m = plant.linear
    inductance = m.electrical_time_constant * m.resistance
    a = np.array(
        [
            [-m.resistance / inductance, -m.torque_constant / inductance, 0],
            [m.torque_constant / m.inertia, -m.damping / m.inertia, 0],
            [0, 1, 0],
        ]
    )
    block = np.zeros((4, 4))
    block[:3, :3] = a * period
    block[0, 3] = period / inductance
    phi = linalg.expm(block)
    x, states = np.array([0, 0, plant.angle]), []
    for d in duty:
        states.append(x)
        x = phi[:3, :3] @ x + phi[:3, 3] * (V * d / 250)
    return np.array(states)[:, 1:].T


@pytest.fixture
def excitation():
    rng = np.random.default_rng(3)
    return np.repeat(rng.integers(-250, 251, 60), 7)


def test_linear_values_are_those_of_the_file():
    with Plant("[motor]\ngain_rad_s_V = 11\npole_rad_s = 31\nviscous_share = 0.06\nresistance_ohm = 3\n") as p:
        m = p.linear
    assert m.gain == pytest.approx(11) and m.pole == pytest.approx(31)
    total = m.damping * m.resistance + m.torque_constant**2
    assert m.damping * m.resistance / total == pytest.approx(0.06)
    with Plant("[motor]\ntorque_constant_Nm_A = 0.09\ninertia_kgm2 = 5e-5\ndamping_Nms = 1e-4\n") as p:
        assert p.linear.gain == pytest.approx(0.09 / (1e-4 * 4.5 + 0.09**2))


def test_second_order_motor_is_exact(excitation):
    with Plant(MEAN) as p:
        speed, angle = exact(p, excitation)
        run = p.sequence(excitation)
    assert np.abs(run.speed - speed).max() < 2e-6 * np.abs(speed).max()
    assert np.abs(run.angle - angle).max() < 1e-6


def test_first_order_motor_is_exact(excitation):
    p_, g = math.exp(-A * T), (1 - math.exp(-A * T)) / (A * T)
    with Plant(FIRST_ORDER) as p:
        run = p.sequence(excitation)
    w, angle = 0.0, run.angle[0]
    for k, u in enumerate(excitation * V / 250):
        assert run.speed[k] == pytest.approx(w, abs=1e-7)
        assert run.angle[k] == pytest.approx(angle, abs=1e-8)
        angle += T * (g * w + K * (1 - g) * u)
        w = p_ * w + K * (1 - p_) * u


def test_pulses_mean_what_their_duty_says(excitation):
    with Plant() as edges, Plant(MEAN) as mean:
        a, b = edges.sequence(excitation), mean.sequence(excitation)
    # A centred pulse has the mean's zeroth and first moments; what is left is its second, 1e-4 rad here.
    assert np.abs(a.angle - b.angle).max() < 3e-4
    counts = a.count - b.count
    assert np.abs(counts).max() <= 1


def test_delay_of_the_duty(excitation):
    """A duty 2 ms late is 2/5 of the tick the old one."""
    with Plant(MEAN + "[transport_delay]\ndelay_s = 0.002\n") as p, Plant(MEAN) as q:
        fine = np.repeat(excitation, 5)
        fine = np.concatenate(([0, 0], fine[:-2]))
        late, reference = p.sequence(excitation), q.sequence(fine, period_s=0.001)
    assert np.abs(late.angle - reference.angle[::5]).max() < 1e-9
    with Plant(MEAN) as p:
        board = p.sequence(excitation, delay_s=0.002)
    assert np.abs(late.angle - board.angle).max() < 1e-9


def test_counts_are_the_angle_rounded_down(excitation):
    with Plant("[encoder]\nstart_fraction = 0.25\n") as p:
        run = p.sequence(excitation)
    expected = np.floor((run.angle - run.angle[0]) * 617.4 / (2 * np.pi) + 0.25)
    assert np.array_equal(run.count, expected)


def test_edges_come_in_order_and_where_the_angle_says():
    with Plant(MEAN + "[encoder]\nstart_fraction = 0.0\n") as p:
        p.sequence([250] * 200)
        count, speed = p.count, p.speed
        edges = p.hold(1.0, 0.01)
    times, counts = np.array(edges).T
    assert np.array_equal(counts, np.arange(count + 1, count + 1 + len(counts)))
    assert np.all(np.diff(times) > 0)
    assert np.diff(times) == pytest.approx(2 * np.pi / 617.4 / speed, rel=1e-4)


# ---- friction


def test_friction_stops_when_it_should():
    """w' = -a (w + K f): standstill after ln(1 + w0 / (K f)) / a."""
    friction = 0.5
    with Plant(FIRST_ORDER + f"[coulomb_friction]\nvolts_V = {friction}\n") as p:
        p.sequence([250] * 400)
        began = p.speed
        assert began == pytest.approx(K * (V - friction), rel=1e-6)
        stop = math.log(1 + began / (K * friction)) / A
        run = p.sequence([0] * 400, period_s=0.001)
    moving = int(stop / 0.001)
    assert run.speed[moving] > 0 and np.all(run.speed[moving + 1 :] == 0)
    turned = (began + K * friction) * (1 - math.exp(-A * stop)) / A - K * friction * stop
    assert run.angle[-1] - run.angle[0] == pytest.approx(turned, rel=1e-6)


def test_friction_holds_up_to_its_size():
    plant = MEAN + "[coulomb_friction]\nvolts_V = 0.74\n"
    assert steady_speed(plant, duty=25) == 0
    assert steady_speed(plant, duty=-25) == 0
    assert steady_speed(plant, duty=26) == pytest.approx(K * (26 / 250 * V - 0.74), rel=1e-3)


def test_stiction_needs_more_to_start_than_to_keep_on():
    plant = MEAN + "[stiction]\nvolts_V = 0.3\nstatic_volts_V = 0.6\nstribeck_speed_rad_s = 1.0\n"
    held, moves = 20, 21  # 0.592 and 0.622 V
    assert steady_speed(plant, held) == 0
    assert steady_speed(plant, moves) == pytest.approx(K * (0.6216 - 0.3), rel=2e-3)
    with Plant(plant) as p:
        p.sequence([60] * 100)
        assert p.sequence([held] * 300).speed[-1] == pytest.approx(K * (0.592 - 0.3), rel=2e-3)


def test_friction_under_a_sine_is_exact():
    """The first-order motor's exponentials from stop to stop, in closed form."""
    friction, volts, w = 0.4, 2.0, 2 * np.pi * 3.0
    duty = np.round(250 * volts / V * np.sin(w * T * np.arange(200))).astype(int)
    with Plant(FIRST_ORDER + f"[coulomb_friction]\nvolts_V = {friction}\n") as p:
        run = p.sequence(duty)
    speed, angle = 0.0, run.angle[0]
    for k, u in enumerate(duty * V / 250):
        assert run.angle[k] == pytest.approx(angle, abs=2e-6)
        assert run.speed[k] == pytest.approx(speed, abs=2e-4)
        left = T
        while left > 1e-15:
            if speed == 0 and abs(u) <= friction:
                break
            way = math.copysign(1, speed if speed else u)
            end = K * (u - way * friction)
            stop = math.inf if speed * end >= 0 else math.log(1 - speed / end) / A
            h = min(left, stop)
            decay = math.exp(-A * h)
            angle += end * h + (speed - end) * (1 - decay) / A
            speed = 0.0 if h == stop else end + (speed - end) * decay
            left -= h


# ---- one effect at a time, by what it does to a steady state


@pytest.mark.parametrize(
    ("effect", "volts"),
    [
        ("", 3.7),
        ("[dead_zone]\nvolts_V = 0.5", 3.2),
        ("[input_threshold]\nvolts_V = 3.6", 3.7),
        ("[input_threshold]\nvolts_V = 3.8", 0),
        ("[voltage_offset]\nvolts_V = -0.3", 3.4),
        ("[voltage_saturation]\nvolts_V = 2.2", 2.2),
        ("[direction_asymmetry]\nratio = 0.1", 4.07),
        ("[load_torque]\nvolts_V = 0.4", 3.3),
        ("[coulomb_friction]\nvolts_V = 0.4", 3.3),
        ("[battery]\nvolts_V = 6.0", 3.0),
        ("[wiring]\nmotor_swapped = true", -3.7),
        ("[dead_zone]\nvolts_V = 0.5\n[load_torque]\nvolts_V = 0.2", 3.0),
    ],
)
@pytest.mark.parametrize("mode", [MEAN, ""])
def test_steady_speed(effect, volts, mode):
    # With pulses the speed at the tick differs from its mean by the ripple.
    assert steady_speed(mode + effect + "\n") == pytest.approx(K * volts, rel=1e-3 if not mode else 1e-5, abs=1e-9)


def test_asymmetry_is_one_way():
    assert steady_speed(MEAN + "[direction_asymmetry]\nratio = 0.1\n", -HALF) == pytest.approx(-K * 3.7 * 0.9)


def test_quadratic_drag():
    c = 2e-4
    w = steady_speed(MEAN + f"[quadratic_drag]\nvolts_V_s2_rad2 = {c}\n")
    assert w == pytest.approx(K * (3.7 - c * w * w), rel=1e-6)


def test_supply_sag():
    """u = D (Vs - Rs |D i|)."""
    with Plant(MEAN + "[supply_sag]\nratio = 0.2\n[motor]\nviscous_share = 0.2\n") as p:
        run = p.sequence([HALF] * 400)
        m, i = p.linear, p.current
        volts = 0.5 * (V - 0.2 * m.resistance * 0.5 * i)
        assert run.speed[-1] == pytest.approx(m.gain * volts, rel=1e-6)
        assert i * m.torque_constant == pytest.approx(m.damping * run.speed[-1], rel=1e-5)
        assert p.supply == pytest.approx(V - 0.2 * m.resistance * 0.5 * i, rel=1e-6)


def test_battery_droops_with_the_charge_drawn():
    plant = "[battery]\ndroop_V_per_As = 0.5\n[motor]\nviscous_share = 0.3\n"
    with Plant(MEAN + plant) as p:
        supply = np.zeros(400)
        run = p.sequence([250] * 400, supply=supply)
    assert 5 < supply[-1] < supply[200] < V
    assert run.speed[-1] < 0.99 * run.speed[150]


def test_supply_drift():
    with Plant(MEAN + "[supply_drift]\nrate_per_s = 0.02\n") as p:
        p.sequence([HALF] * 2000)
        now = p.sequence([HALF]).speed[0]
    # The speed follows the ramp 1/a behind.
    assert now == pytest.approx(K * 3.7 * (1 - 0.02 * (10 - 1 / A)), rel=1e-5)


def test_current_limit():
    """A stalled start: the torque is that of the limit until the back-EMF has come up."""
    with Plant(MEAN + "[current_limit]\nvolts_V = 1.5\n") as p:
        run = p.sequence([250] * 5, period_s=0.001)
        m = p.linear
    acceleration = m.torque_constant * 1.5 / m.resistance / m.inertia
    # The viscous share of the pole takes a little: 40 rad/s x 0.045 x the speed.
    assert run.speed[4] - run.speed[1] == pytest.approx(0.003 * acceleration, rel=0.01)


def test_electrical_pole_takes_the_place_of_the_inductance(excitation):
    with Plant(MEAN + "[electrical_pole]\ntime_constant_s = 0.003\n") as p:
        assert p.linear.electrical_time_constant == pytest.approx(0.003)
        speed, _ = exact(p, excitation)
        assert np.abs(p.sequence(excitation).speed - speed).max() < 1e-6


def test_a_very_short_winding_time_constant_is_stable(excitation):
    with Plant(MEAN + "[electrical_pole]\ntime_constant_s = 2e-6\n") as p, Plant(FIRST_ORDER) as q:
        assert np.abs(p.sequence(excitation).speed - q.sequence(excitation).speed).max() < 0.02


def test_coast_drive_steady_state():
    """Back-EMF and volts act for the share D, friction and its viscous part beta for all of the time."""
    beta, friction = 0.045, 0.3
    for duty in (50, 125, 250):
        share = duty / 250
        expected = K * (share * V - friction) / (share * (1 - beta) + beta)
        w = steady_speed(MEAN + f"[coast_drive]\n[coulomb_friction]\nvolts_V = {friction}\n", duty, ticks=2000)
        assert w == pytest.approx(expected, rel=1e-5)
        # Asked for by the bridge instead of hidden in the plant: the same law.
        asked = steady_speed(MEAN + f"[coulomb_friction]\nvolts_V = {friction}\n", duty, COAST, ticks=2000)
        assert asked == w


def test_coasting_leaves_only_the_viscous_friction():
    with Plant(MEAN) as p:
        p.sequence([250] * 200)
        w = p.sequence([0] * 101, drive=COAST).speed
    assert w[100] / w[0] == pytest.approx(math.exp(-A * 0.045 * 0.5), rel=1e-5)


def test_coast_pulses_are_faster_than_brake_pulses_and_flow_one_way():
    brake, coast = steady_speed("", 50), steady_speed("", 50, COAST, ticks=3000)
    assert coast > 2 * brake
    with Plant() as p:
        currents = []
        for _ in range(400):
            p.hold(0.2, 250e-6, COAST)
            currents.append(p.current)
    assert min(currents) >= 0


def test_winding_heating_moves_the_pole_and_keeps_the_gain():
    plant = MEAN + "[winding_heating]\nrise_ratio = 2.0\ntime_constant_s = 0.5\n[motor]\nviscous_share = 0.001\n"
    with Plant(plant + "[wiring]\njammed_at_s = 0.0\n") as p:
        p.sequence([125] * 2000)
        # i^2 R / (Vs^2 / R0) at standstill with half the supply is R0 / (4 R)
        hot = p.resistance / 4.5
    assert hot - 1 == pytest.approx(2.0 / (4 * hot), rel=1e-3)
    w = steady_speed(plant, ticks=3000)
    assert w == pytest.approx(K * 3.7, rel=2e-3)


# ---- motion with more states, against scipy


def test_cogging_against_scipy():
    volts, cycles, phase = 0.5, 6, 0.7
    plant = FIRST_ORDER + f"[cogging]\nvolts_V = {volts}\ncycles_per_rev = {cycles}\nphase_rad = {phase}\n"
    with Plant(plant) as p:
        run = p.sequence([60] * 100)

    def rate(t, x):
        return [x[1], A * (K * (60 / 250 * V - volts * math.sin(cycles * x[0] + phase)) - x[1])]

    t = T * np.arange(100)
    solution = integrate.solve_ivp(rate, (0, 0.5), [run.angle[0], 0], "DOP853", t, rtol=1e-11, atol=1e-11)
    assert np.abs(run.angle - solution.y[0]).max() < 1e-6


def test_compliance_against_a_state_space_model(excitation):
    f, zeta, ratio = 18.0, 0.05, 0.4
    plant = f"[shaft_compliance]\nfrequency_Hz = {f}\ndamping_ratio = {zeta}\ninertia_ratio = {ratio}\n"
    with Plant(FIRST_ORDER + plant) as p:
        run = p.sequence(excitation)
    w = 2 * np.pi * f
    k, c = ratio * w**2, 2 * zeta * w * ratio  # per rotor inertia
    a = np.array([[-A - c, c, -k], [c / ratio, -c / ratio, k / ratio], [1, -1, 0]])
    block = np.zeros((4, 4))
    block[:3, :3], block[0, 3] = a * T, A * K * T
    phi = linalg.expm(block)
    x = np.zeros(3)
    for row, u in enumerate(excitation * V / 250):
        assert run.speed[row] == pytest.approx(x[0], abs=1e-5)
        x = phi[:3, :3] @ x + phi[:3, 3] * u


def test_backlash_gap_is_free_and_contact_conserves_momentum():
    gap, ratio = 0.2, 0.5
    plant = f"[backlash]\ngap_rad = {gap}\ninertia_ratio = {ratio}\n"
    # Without friction and with the winding open nothing acts on the two masses but the contact.
    with Plant(FIRST_ORDER + plant + "[motor]\nviscous_share = 0\n") as p:
        p.sequence([250] * 2, period_s=0.0005)
        assert p.load_speed == 0 and p.angle - p.load_angle < gap / 2
        momentum = p.speed
        p.sequence([0] * 4000, drive=COAST, period_s=0.001)
        assert p.load_speed > 0
        assert p.speed + ratio * p.load_speed == pytest.approx(momentum, rel=1e-9)
        assert abs(p.angle - p.load_angle) < gap / 2 * 1.5


def test_backlash_against_scipy():
    gap, ratio, swing, zeta = 0.08, 0.6, 2 * np.pi * 90, 0.3
    k, c = ratio * swing**2, 2 * zeta * swing * ratio  # per rotor inertia
    duty = np.repeat([200, -200, 120, -60], 15)
    with Plant(FIRST_ORDER + f"[backlash]\ngap_rad = {gap}\ninertia_ratio = {ratio}\n") as p:
        start = p.angle
        run = p.sequence(duty)

    def rate(t, x):
        angle, speed, load_angle, load_speed = x
        twist = angle - load_angle
        beyond = np.sign(twist) * max(abs(twist) - gap / 2, 0)
        push = k * beyond + c * (speed - load_speed) if beyond else 0
        push = push if push * beyond > 0 else 0
        volts = duty[min(int(t / T + 1e-9), len(duty) - 1)] * V / 250
        return [speed, A * (K * volts - speed) - push, load_speed, push / ratio]

    times = T * np.arange(len(duty))
    solution = integrate.solve_ivp(
        rate, (0, times[-1]), [start, 0, start, 0], "RK23", times, max_step=5e-5, rtol=1e-8, atol=1e-10
    )
    assert np.abs(run.angle - solution.y[0]).max() < 5e-4
    assert np.ptp(run.angle) > 2


def test_backlash_in_contact_is_one_mass():
    plant = "[backlash]\ngap_rad = 0.05\ninertia_ratio = 1.0\n"
    with Plant(FIRST_ORDER + plant) as p:
        run = p.sequence([250] * 200)
    slow = run.speed[60] / run.speed[-1]
    assert slow == pytest.approx(1 - math.exp(-A / 2 * 0.3), abs=0.01)


# ---- sensor


def test_eccentricity():
    amplitude, cycles, phase = 0.05, 1, 0.4
    plant = f"[encoder_eccentricity]\namplitude_rad = {amplitude}\ncycles_per_rev = {cycles}\nphase_rad = {phase}\n"
    with Plant(MEAN + plant) as p:
        run = p.sequence([50] * 400)
    read = run.count * 2 * np.pi / 617.4 - (run.angle - run.angle[0])
    error = amplitude * (np.sin(run.angle + phase) - math.sin(run.angle[0] + phase))
    assert np.abs(read - error).max() < 2 * np.pi / 617.4


def test_missed_counts():
    with Plant(MEAN + "[missed_counts]\nratio = 0.1\nspeed_rad_s = 30\n") as p:
        run = p.sequence([60] * 200 + [200] * 200)
    per_rad = 617.4 / (2 * np.pi)
    slow, fast = run.count[199] - run.count[100], run.count[399] - run.count[300]
    assert slow == pytest.approx((run.angle[199] - run.angle[100]) * per_rad, abs=1.1)
    assert fast == pytest.approx(0.9 * (run.angle[399] - run.angle[300]) * per_rad, abs=1.1)


def test_sensor_lag():
    with Plant(MEAN + "[sensor_lag]\ntime_constant_s = 0.02\n") as p:
        run = p.sequence([125] * 400)
    behind = run.angle[-1] - run.angle[0] - run.count[-1] * 2 * np.pi / 617.4
    assert behind == pytest.approx(0.02 * run.speed[-1], abs=2 * np.pi / 617.4)


@pytest.mark.parametrize(("key", "sign"), [("encoder_swapped", -1), ("motor_swapped", -1)])
def test_swapped_wires(key, sign):
    with Plant(MEAN + f"[wiring]\n{key} = true\n") as p, Plant(MEAN) as q:
        a, b = p.sequence([100] * 100).count[-1], q.sequence([100] * 100).count[-1]
    assert a == pytest.approx(sign * b, abs=1)


# ---- outside the vocabulary


def test_late_load():
    with Plant(MEAN + "[late_load]\nstart_s = 2.0\nvolts_V = 0.5\n") as p:
        run = p.sequence([HALF] * 800)
    assert run.speed[399] == pytest.approx(K * 3.7, rel=1e-6)
    assert run.speed[-1] == pytest.approx(K * 3.2, rel=1e-6)


def test_outside_torque():
    f, volts = 3.3, 0.4
    with Plant(FIRST_ORDER + f"[outside_torque]\nfrequency_Hz = {f}\nvolts_V = {volts}\n") as p:
        run = p.sequence([HALF] * 2000)
    w = 2 * np.pi * f
    tone = 2 * np.mean((run.speed - K * 3.7)[-1000:] * np.exp(-1j * w * T * np.arange(1000, 2000)))
    assert abs(tone) == pytest.approx(K * volts / abs(1 + 1j * w / A), rel=0.01)


def test_wandering_torque():
    volts = []
    for seed in range(8):
        wander = f"[wandering_torque]\nvolts_V = 0.4\ntime_constant_s = 0.5\n[bench]\nseed = {seed}\n"
        with Plant(FIRST_ORDER + wander) as p:
            volts.append(p.sequence([HALF] * 2000).speed[100:] / K - 3.7)
    spread = np.std(volts)
    assert 0.3 < spread < 0.5
    lag = round(0.5 / T)
    pairs = np.array(volts)
    correlation = np.mean(pairs[:, lag:] * pairs[:, :-lag]) / spread**2
    assert 0.15 < correlation < 0.6  # exp(-1)


# ---- the library itself


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("[friction]\n", "line 1: no effect or part is called [friction]"),
        ("[cogging]\nvolts_V = 1\n", "[cogging] needs cycles_per_rev"),
        ("\n[dead_zone]\nvolt = 1\n", "line 3: [dead_zone] has no key volt"),
        ("[dead_zone]\nvolts_V = -1\n", "line 2: volts_V = -1 is out of range"),
        ("[dead_zone]\nvolts_V = much\n", "line 2: volts_V must be a number"),
        ("[dead_zone\n", "line 1: a table is written [name]"),
        ("[dead_zone]\nvolts_V\n", "line 2: expected key = value"),
        ("[dead_zone]\nvolts_V = 1 2\n", "line 2: volts_V must be a number"),
        ("[bench]\nstep_s = 1e-3\n", "line 2: step_s = 0.001 is out of range"),
    ],
)
def test_plant_files_that_do_not_fit(text, sentence):
    with pytest.raises(ValueError, match=r".") as raised:
        Plant(text)
    assert str(raised.value) == sentence


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
