"""The bench: what an encoder can tell, and the experiments that make recordings."""

from jaxmotor.bench._assemble import Run as Run
from jaxmotor.bench._encoder import SpeedResolution as SpeedResolution
from jaxmotor.bench._encoder import resolution_table as resolution_table
from jaxmotor.bench._encoder import speed_resolution as speed_resolution
from jaxmotor.bench._listen import Progress as Progress
from jaxmotor.bench._listen import Watch as Watch
from jaxmotor.bench._log import Piece as Piece
from jaxmotor.bench._plan import BUILT_IN as BUILT_IN
from jaxmotor.bench._plan import Experiment as Experiment
from jaxmotor.bench._plan import Plan as Plan
from jaxmotor.bench._plan import PlanError as PlanError
from jaxmotor.bench._plan import load_plan as load_plan
from jaxmotor.bench._plan import parse_plan as parse_plan
from jaxmotor.bench._port import Patience as Patience
from jaxmotor.bench._port import Port as Port
from jaxmotor.bench._protocol import Decoder as Decoder
from jaxmotor.bench._protocol import RecorderError as RecorderError
from jaxmotor.bench._recorder import Incomplete as Incomplete
from jaxmotor.bench._recorder import record as record
from jaxmotor.bench._recorder import recover as recover
from jaxmotor.bench._signals import experiment_volts as experiment_volts
