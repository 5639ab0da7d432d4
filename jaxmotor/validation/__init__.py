"""A model against data that it was not fitted to: open loop, mean of step trials, closed loop."""

from jaxmotor.validation._controller import controller_of as controller_of
from jaxmotor.validation._drawn_motors import draw_motors as draw_motors
from jaxmotor.validation._json import to_json as to_json
from jaxmotor.validation._loops import loop_of_motors as loop_of_motors
from jaxmotor.validation._open_loop import score_of as score_of
from jaxmotor.validation._open_loop import score_open_loop as score_open_loop
from jaxmotor.validation._validate import validate as validate
from jaxmotor.validation._validation import Band as Band
from jaxmotor.validation._validation import ClosedLoop as ClosedLoop
from jaxmotor.validation._validation import Comparison as Comparison
from jaxmotor.validation._validation import Interval as Interval
from jaxmotor.validation._validation import LoopRun as LoopRun
from jaxmotor.validation._validation import OpenLoop as OpenLoop
from jaxmotor.validation._validation import Score as Score
from jaxmotor.validation._validation import Skipped as Skipped
from jaxmotor.validation._validation import StepTrials as StepTrials
from jaxmotor.validation._validation import Validation as Validation
from jaxmotor.validation._validation import limits as limits
