"""The motor for other programs: one writer per format."""

from jaxmotor.present.exports._arduino import to_arduino as to_arduino
from jaxmotor.present.exports._arduino import write_library as write_library
from jaxmotor.present.exports._c_header import to_c as to_c
from jaxmotor.present.exports._design import Design as Design
from jaxmotor.present.exports._design import design as design
from jaxmotor.present.exports._json import to_export_json as to_export_json
from jaxmotor.present.exports._left_out import left_out as left_out
from jaxmotor.present.exports._mujoco import GUESSED_INERTIA as GUESSED_INERTIA
from jaxmotor.present.exports._mujoco import to_mujoco as to_mujoco
from jaxmotor.present.exports._python_control import ControlMotor as ControlMotor
from jaxmotor.present.exports._python_control import to_control as to_control
from jaxmotor.present.exports._python_control import to_python as to_python
from jaxmotor.present.exports._spice import GUESSED_RESISTANCE as GUESSED_RESISTANCE
from jaxmotor.present.exports._spice import to_spice as to_spice
from jaxmotor.present.exports._wpilib import to_wpilib as to_wpilib
