"""Motors: linear ones with their exact sampled response, effects that extend them, and their simulation."""

from jaxmotor.motor._linear import AbstractLinearMotor as AbstractLinearMotor
from jaxmotor.motor._linear import FirstOrder as FirstOrder
from jaxmotor.motor._linear import Hold as Hold
from jaxmotor.motor._linear import SecondOrder as SecondOrder
from jaxmotor.motor._linear import linear_motor as linear_motor
from jaxmotor.motor._motor import AbstractController as AbstractController
from jaxmotor.motor._motor import Motor as Motor
from jaxmotor.motor._motor import Rows as Rows
from jaxmotor.motor._motor import Run as Run
from jaxmotor.motor._motor import SpeedLoop as SpeedLoop
from jaxmotor.motor._motor import simulate_motor as simulate_motor
from jaxmotor.motor._motor import steps_for as steps_for
from jaxmotor.motor._scan import scan_rows as scan_rows
from jaxmotor.motor._simulate import Motion as Motion
from jaxmotor.motor._simulate import simulate as simulate
from jaxmotor.motor._zoh import hold_with_delay as hold_with_delay
from jaxmotor.motor._zoh import mean_speed_response as mean_speed_response
from jaxmotor.motor._zoh import paper_response as paper_response
from jaxmotor.motor._zoh import position_response as position_response
from jaxmotor.motor._zoh import speed_response as speed_response
from jaxmotor.motor._zoh import step_response as step_response
from jaxmotor.motor._zoh import to_complex as to_complex
from jaxmotor.motor._zoh import unmodelled_by_paper as unmodelled_by_paper
from jaxmotor.motor._zoh import zoh_factor as zoh_factor
from jaxmotor.motor.effects import EFFECTS as EFFECTS
from jaxmotor.motor.effects import AbstractEffect as AbstractEffect
