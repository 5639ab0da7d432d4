"""Hobby gearmotors as data sheets and sellers have them, and motors drawn around them in physical units.

Sheets give supply, speed and current without load, and current at stall. The rest is derived:

- R = V/I_stall; back-EMF constant = (V - R I_0)/w_0; torque per ampere is the same number in SI.
- Rotor: nobody states its inertia. A cylinder of 0.35 of the motor's mass and 0.3 of its diameter as radius; the gears'
  and the hub's inertia is drawn as a multiple of it.
- Torque without load is constant times I_0. Of it `VISCOUS` is taken to be viscous: the linear motor has no other.
- L/R: sheets do not state it; small ironcore motors have some 0.1 ms. What is longer is a law of its own here.
"""

from typing import NamedTuple

import numpy as np

from testing.second_plant import Plant


class Sheet(NamedTuple):
    """One kind of motor, without its gearbox."""

    name: str
    supply_V: float
    speed_rad_s: float
    no_load_A: float
    stall_A: float
    motor_kg: float
    can_m: float
    counts: float
    """Of the encoder, all edges, in one turn of the rotor."""
    ratios: tuple[float, ...]
    inertia: tuple[float, float]
    """Rotor, gears and hub over the rotor alone."""


RPM = 2 * np.pi / 60
SHEETS = (
    # Pololu, "37D Metal Gearmotors" rev 1.2: 10 000 rpm, 0.2 A, stall 5.5 A, 64 counts; 34.5 mm can. Mass estimated.
    Sheet("37D 12V", 12.0, 1e4 * RPM, 0.2, 5.5, 0.11, 0.0345, 64, (18.75, 30.0, 50.0, 70.0, 102.08), (1.1, 2.5)),
    # Pololu item 4845, 25D HP 12 V 46.85:1: 220 rpm, 0.3 A, stall 5.0 A; data sheet: 60 g with encoder, 24.2 mm can.
    Sheet("25D HP 12V", 12.0, 220 * 46.85 * RPM, 0.3, 5.0, 0.055, 0.0242, 48, (9.68, 20.4, 34.0, 46.85), (1.5, 4.0)),
    # Pololu item 5215, micro metal HPCB 12 V 75.81:1: 450 rpm, 80 mA, 0.75 A, 12 counts. Motor 5 g of the whole 10 g.
    Sheet("micro HPCB 12V", 12.0, 450 * 75.81 * RPM, 0.08, 0.75, 0.005, 0.012, 12, (29.86, 51.45, 75.81), (1.2, 3.0)),
    # Pololu, "Micro Metal Gearmotors" rev 2.0, LP 6 V 100.37:1: 130 rpm, 20 mA, 0.36 A.
    Sheet("micro LP 6V", 6.0, 130 * 100.37 * RPM, 0.02, 0.36, 0.005, 0.012, 12, (51.45, 100.37, 150.58), (1.5, 4.0)),
    # N20 with a disc of 7 poles (28 edges), electrically as the micro LP, at 12 V as sellers list it: figures derived.
    Sheet("N20 12V", 12.0, 15000 * RPM, 0.04, 0.7, 0.005, 0.012, 28, (30.0, 50.0, 100.0), (1.2, 3.5)),
    # JGA25-370 12 V 21.3:1 as sellers list it (280 rpm, 0.1 A, 1.5 A, 11 poles: 44 edges): no data sheet, derived.
    Sheet("JGA25-370", 12.0, 280 * 21.3 * RPM, 0.1, 1.5, 0.05, 0.0244, 44, (9.6, 21.3, 34.0, 45.0, 74.8), (1.5, 4.0)),
    # TT motor 48:1 at 6 V (zbotic.in): 200 rpm, 0.15 A, 0.6 A; a 130-size motor of 17 g; 20 edges a turn assumed.
    Sheet("TT 6V", 6.0, 200 * 48 * RPM, 0.15, 0.6, 0.017, 0.0175, 20, (48.0,), (1.2, 2.5)),
    # Lego NXT (mindstormsnxt.blogspot.com): 9 V, 170 rpm, 60 mA, 2 A; 360 counts at the output, 48:1; large gears.
    Sheet("Lego NXT", 9.0, 170 * 48 * RPM, 0.06, 2.0, 0.03, 0.020, 7.5, (48.0,), (4.0, 8.0)),
)
UNIT_SPREAD = 0.08
"""Relative, of one motor to the next."""
VISCOUS = (0.3, 0.8)
LAG_S = (1e-4, 2.5e-4)
SCALES = (255, 400, 1000, 1023)
"""Full scales of the duty: Arduino, Pololu's shields, parts per thousand, ESP32."""


class Rig(NamedTuple):
    """A motor without anything wrong, and what it is recorded with."""

    name: str
    plant: Plant
    no_load_N_m: float
    """All that turns the motor without load."""
    counts_per_rev: float
    """At the output shaft."""
    full_scale: int
    period_s: float

    @property
    def supply_V(self) -> float:
        return self.plant.supply_V

    @property
    def top_rad_s(self) -> float:
        return self.plant.gain * self.plant.supply_V

    @property
    def stall_N_m(self) -> float:
        return self.plant.per_volt * self.plant.supply_V


def draw_rig(rng: np.random.Generator) -> Rig:
    """A motor around one of `SHEETS`, supply, encoder, duty and rows."""
    sheet = SHEETS[int(rng.integers(len(SHEETS)))]
    ratio = float(rng.choice(sheet.ratios))

    def about(value: float) -> float:
        return value * float(np.exp(rng.normal(0.0, UNIT_SPREAD)))

    resistance = about(sheet.supply_V / sheet.stall_A)
    constant = about((sheet.supply_V - sheet.supply_V / sheet.stall_A * sheet.no_load_A) / sheet.speed_rad_s)
    rotor = 0.5 * 0.35 * sheet.motor_kg * (0.3 * sheet.can_m) ** 2
    inertia = rotor * float(np.exp(rng.uniform(*np.log(sheet.inertia))))
    no_load = about(constant * sheet.no_load_A)
    plant = Plant(
        resistance_ohm=resistance,
        inductance_H=resistance * float(np.exp(rng.uniform(*np.log(LAG_S)))),
        constant_V_s=constant * ratio,
        inertia_kg_m2=inertia * ratio**2,
        viscous_N_m_s=float(rng.uniform(*VISCOUS)) * no_load / sheet.speed_rad_s * ratio**2,
        supply_V=round(sheet.supply_V * float(rng.uniform(0.85, 1.1)), 2),
    )
    period = float(rng.choice([0.002, 0.004, 0.005, 0.006, 0.008, 0.01]))
    period = min(period, 0.01 if plant.pole < 40 else 0.006)
    return Rig(sheet.name, plant, no_load * ratio, sheet.counts * ratio, int(rng.choice(SCALES)), period)
