"""A model against data that it was not fitted to: open loop, mean of step trials, closed loop."""

from jaxmotor.validate._json import to_json as to_json
from jaxmotor.validate._validate import validate as validate
from jaxmotor.validate._validation import Band as Band
from jaxmotor.validate._validation import ClosedLoop as ClosedLoop
from jaxmotor.validate._validation import Comparison as Comparison
from jaxmotor.validate._validation import Interval as Interval
from jaxmotor.validate._validation import OpenLoop as OpenLoop
from jaxmotor.validate._validation import Score as Score
from jaxmotor.validate._validation import Skipped as Skipped
from jaxmotor.validate._validation import StepTrials as StepTrials
from jaxmotor.validate._validation import Validation as Validation
