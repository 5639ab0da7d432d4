"""The motor as a MuJoCo joint and actuator whose control is the bridge voltage.

With an inertia J at the output shaft, J w' = a J (K u - w) - friction is

    <joint armature="J" frictionloss="a J K v">      and      force = a J K u - a J w

a `<general>` actuator with gainprm = a J K and biasprm = (a J K u0, 0, -a J). Voltage and encoder do not show J: any J
gives the same motion of a free shaft, and the right one, with a load on it, is for who knows it to state.
"""

from jaxmotor._arguments import check_positive
from jaxmotor.control import feed_forward, linear_numbers, parameter_of, slow_pole
from jaxmotor.estimate import AnyModel, model_of
from jaxmotor.present.exports._fixed_point import ascii_line
from jaxmotor.present.exports._left_out import left_out

INERTIA_kgm2 = 1e-4
LONGEST_STEP_s, STEPS = 1e-3, 10
"""Of MuJoCo's, and how many there are at least in the motor's time constant. An electrical lag asks for no shorter one:
its filter is exact for any step, and acts early."""
GUESSED_INERTIA = (
    f"J = {INERTIA_kgm2:g} kg m2 is a guess: a free shaft moves alike for any J, a loaded one does not. State yours."
)


def to_mujoco(model: AnyModel, *, inertia_kgm2: float | None = None, supply_V: float | None = None) -> str:
    """MJCF with one hinge, its actuator and its sensors; to be loaded as it is, or copied from.

    **Raises:** `JaxmotorError` where inertia or supply are not positive.
    """
    model = model_of(model)
    supply_V = model.rig.supply_V if supply_V is None else supply_V
    check_positive("inertia", inertia_kgm2)
    check_positive("supply", supply_V)
    inertia = INERTIA_kgm2 if inertia_kgm2 is None else inertia_kgm2
    (gain, pole, electrical), law = linear_numbers(model.whole), feed_forward(model.whole)
    lag = electrical
    if 0 < 4 * pole * lag < 1:
        # Two real poles: the slower for the joint, the faster for the filter, and G(s) is exact.
        pole, lag = slow_pole(model.whole), lag / pole * slow_pole(model.whole)
    damping = pole * inertia
    per_volt = damping * gain
    constant = per_volt * (float(law.offset_V) - float(law.load_V))
    limit = min(filter(None, (supply_V, parameter_of(model.whole, "voltage_saturation", "volts_V"))), default=None)
    step = min(LONGEST_STEP_s, 1 / pole / STEPS)
    # Early: the force within a step is that of the filter at its end; else it comes a step late, however short the lag.
    dynamics = f' dyntype="filterexact" dynprm="{lag:.9g}" actearly="true"' if lag else ""
    limits = "" if limit is None else f' ctrllimited="true" ctrlrange="{-limit:.9g} {limit:.9g}"'
    notes = [f"Not carried: {sentence}" for sentence in left_out(model, "mujoco")]
    if electrical:
        notes.append(
            f"The electrical lag of {1e3 * electrical:.4g} ms is a filter on the voltage here: exact for the free "
            "linear motor where both poles are real, but a load or friction meets no lag."
        )
    if inertia_kgm2 is None:
        notes.append(GUESSED_INERTIA)
    return f"""\
<!--
  A motor, written by jaxmotor export, from {_text(model.recording) or "an unnamed recording"}.
  Control: volts at the bridge. Gain K = {gain:.6g} rad/s/V, pole a = {pole:.6g} rad/s, armature J:
  gain a J K, back-EMF and damping a J, frictionloss a J K v.
{"".join(f"  {_text(note)}" + chr(10) for note in notes)}-->
<mujoco model="motor">
  <option timestep="{step:.9g}" gravity="0 0 0" integrator="implicitfast"/>
  <worldbody>
    <body name="rotor">
      <inertial pos="0 0 0" mass="1e-3" diaginertia="{1e-6 * inertia:.9g} {1e-6 * inertia:.9g} {1e-6 * inertia:.9g}"/>
      <joint name="shaft" type="hinge" axis="0 0 1" armature="{inertia:.9g}"
        frictionloss="{abs(per_volt * float(law.friction_V)):.9g}" solreffriction="{2 * step:.9g} 1"
        solimpfriction="0.9999 0.9999 0.001 0.5 2"/>
    </body>
  </worldbody>
  <actuator>
    <general name="motor" joint="shaft"{dynamics}{limits} gaintype="fixed" gainprm="{per_volt:.9g}"
      biastype="affine" biasprm="{constant:.9g} 0 {-damping:.9g}"/>
  </actuator>
  <sensor>
    <jointpos name="angle" joint="shaft"/>
    <jointvel name="speed" joint="shaft"/>
  </sensor>
</mujoco>
"""


def _text(text: str) -> str:
    """`text` as it may stand in an XML comment, which has no double hyphen."""
    return ascii_line(text)[:200].replace("-", "_").replace("<", "(").replace(">", ")")
