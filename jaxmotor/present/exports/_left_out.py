"""What a format cannot carry of a model, in sentences."""

from jaxmotor.control import COMPENSATED
from jaxmotor.estimate import Model

LINEAR = {"electrical_pole", "transport_delay"}
CARRIED = {
    "control": {*LINEAR, "voltage_offset"},
    "c": {*LINEAR, *COMPENSATED} - {"stiction"},
    "wpilib": {"coulomb_friction", "dead_zone"},
    "spice": {"electrical_pole", "coulomb_friction", "quadratic_drag", "load_torque", "voltage_offset"},
    "mujoco": {"coulomb_friction", "voltage_saturation", "electrical_pole", "load_torque", "voltage_offset"},
}
"""Effects by the formats that have a place for them; `json` has for all."""
PARTLY = {
    ("c", "stiction"): "stiction: compensated is the friction while turning, not the larger one at rest",
    ("mujoco", "stiction"): "stiction: MuJoCo's frictionloss is the friction while turning, not the larger one at rest",
    ("control", "transport_delay"): "transport_delay: in `sampled` only; G(s) is without it",
    ("spice", "stiction"): "stiction: held is the friction while turning, not the larger one at rest",
    ("wpilib", "stiction"): "stiction: kS is the friction while turning, not the larger one at rest",
    ("c", "sensor_lag"): "sensor_lag: the loops' gains take it as a delay of its time constant, the estimator too",
}


def left_out(model: Model, format_: str) -> list[str]:
    """One sentence for each effect of `model` that `format_` cannot hold, or holds in part."""
    sentences = []
    for effect in model.whole.effects:
        if (format_, effect.name) in PARTLY:
            sentences.append(PARTLY[format_, effect.name])
        elif effect.name not in CARRIED.get(format_, {effect.name}):
            law = (type(effect).__doc__ or "its law").strip().splitlines()[0]
            sentences.append(f"{effect.name}: {law}")
    return sentences
