"""From a log and a motor to the readings that the log would hold: what every fit, score and figure compares with."""

from jaxmotor.prediction._effects import residuals as residuals
from jaxmotor.prediction._effects import seen as seen
from jaxmotor.prediction._initial_state import SPEED_STEP as SPEED_STEP
from jaxmotor.prediction._initial_state import fit_initial_speeds as fit_initial_speeds
from jaxmotor.prediction._initial_state import without_beginnings as without_beginnings
from jaxmotor.prediction._initial_state import without_initial_speeds as without_initial_speeds
from jaxmotor.prediction._linear import motor_of as motor_of
from jaxmotor.prediction._linear import observe as observe
from jaxmotor.prediction._linear import predict as predict
from jaxmotor.prediction._linear import start_columns as start_columns
from jaxmotor.prediction._log import Log as Log
from jaxmotor.prediction._log import log_of as log_of
from jaxmotor.prediction._log import steps_per_row as steps_per_row
from jaxmotor.prediction._packing import ROOMY as ROOMY
from jaxmotor.prediction._packing import Lanes as Lanes
from jaxmotor.prediction._packing import Observation as Observation
from jaxmotor.prediction._packing import Packed as Packed
from jaxmotor.prediction._packing import Room as Room
from jaxmotor.prediction._packing import bucket as bucket
from jaxmotor.prediction._packing import pack as pack
from jaxmotor.prediction._packing import pieces_of as pieces_of
from jaxmotor.prediction._packing import resolution as resolution
from jaxmotor.prediction._problem import Problem as Problem
from jaxmotor.prediction._problem import as_problem as as_problem
from jaxmotor.prediction._shaft import shaft_angles as shaft_angles
from jaxmotor.prediction._shaft import supply_of as supply_of
