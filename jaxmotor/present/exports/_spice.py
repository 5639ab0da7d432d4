"""The motor as a SPICE subcircuit, for ngspice and LTspice.

Volts stand for radians per second and amperes for newton metres: at the node `speed` an inertia is a capacitor, viscous
friction a conductance, and a load a current drawn. With the winding's resistance R and the viscous share β of the pole

    k = (1 - β)/K      J = k/(R K a)      b = β a J      L = R τ      friction k v/R

Voltage and encoder do not show R: any R gives the same motion of a free shaft, and the right one is needed for the
current, and for a load.
"""

from jaxmotor._arguments import check_positive
from jaxmotor.control import feed_forward, linear_numbers
from jaxmotor.estimate import AnyModel, model_of
from jaxmotor.present.exports._fixed_point import ascii_line
from jaxmotor.present.exports._left_out import left_out

RESISTANCE_ohm = 1.0
SLOPE = 1e-3
"""Volts of the motor's speed within which friction changes sides."""
GUESSED_RESISTANCE = f"R = {RESISTANCE_ohm:g} ohm is a guess: the current and what a load does need the measured one."


def to_spice(model: AnyModel, *, resistance_ohm: float | None = None) -> str:
    """A `.subckt` with the winding's two terminals, a node for the speed [rad/s] and one for the angle [rad].

    **Raises:** `JaxmotorError` where the resistance is not positive.
    """
    model = model_of(model)
    check_positive("resistance", resistance_ohm)
    resistance = RESISTANCE_ohm if resistance_ohm is None else resistance_ohm
    (gain, pole, lag), law = linear_numbers(model.whole), feed_forward(model.whole)
    share = float(model.whole.viscous_share)
    # Torques in volts at the winding; of a load, what moves the shaft is negative.
    friction, drag = abs(float(law.friction_V)), abs(float(law.drag_V_s2_rad2))
    load = float(law.load_V)
    parts = [
        f"Vu plus w1 {-float(law.offset_V):.9g}",
        "Rw w1 w2 {R}",
        f"Lw w2 w3 {{R*{lag:.9g}}} ic=0" if lag else "Vl w2 w3 0",
        "Vi w3 w4 0",
        "Ek w4 minus speed 0 {k}",
        "Fk 0 speed Vi {k}",
        "Cj speed 0 {J} ic=0",
    ]
    if share:
        parts.append(f"Gb speed 0 speed 0 {{{share * pole:.9g}*J}}")
    if friction:
        parts.append(f"Bf speed 0 I={{abs(k)/R*{friction:.9g}}}*tanh(V(speed)/{{W0}})")
    if drag:
        parts.append(f"Bd speed 0 I={{abs(k)/R*{drag:.9g}}}*V(speed)*abs(V(speed))")
    if load:
        parts.append(f"Il speed 0 {{k/R*{load:.9g}}}")
    notes = [f"Not carried: {sentence}" for sentence in left_out(model, "spice")]
    if friction:
        notes.append("Friction is k v/R tanh(speed/W0): held at rest, the shaft creeps by less than W0 where torque")
        notes[-1] += " is below three quarters of it. A smaller W0 [rad/s] is truer and slower."
    if not share:
        notes.append("Viscous friction is counted with the back-EMF: voltage and encoder do not tell them apart.")
    if resistance_ohm is None:
        notes.append(GUESSED_RESISTANCE)
    comments = "".join(f"* {ascii_line(note)[:400]}\n" for note in notes)
    return f"""\
* A motor, written by jaxmotor export, from {ascii_line(model.recording)[:200] or "an unnamed recording"}.
* Gain K = {gain:.6g} rad/s/V, pole a = {pole:.6g} rad/s, electrical time constant {lag:.4g} s.
* plus, minus: the winding [V, A]. speed: 1 V is 1 rad/s, 1 A is 1 N m; a load's inertia is a capacitor to ground, its
* torque a current. angle: 1 V is 1 rad. All at the output shaft. Begin at rest: .tran ... uic
{comments}.subckt motor plus minus speed angle params: R={resistance:.9g} W0={SLOPE * abs(gain):.6g}
.param k={(1 - share) / gain:.9g}
.param J={{k/(R*{gain * pole:.9g})}}
{chr(10).join(parts)}
Ga 0 angle speed 0 1
Ca angle 0 1 ic=0
Ra angle 0 1e9
.ends motor
"""
