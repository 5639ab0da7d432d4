"""Where the simulation fails, why, and how much an extended model improves it."""

from jaxmotor.diagnosis._before_after import BeforeAfter as BeforeAfter
from jaxmotor.diagnosis._before_after import Intervals as Intervals
from jaxmotor.diagnosis._diagnose import diagnose as diagnose
from jaxmotor.diagnosis._diagnosis import Diagnosis as Diagnosis
from jaxmotor.diagnosis._diagnosis import extended_model as extended_model
from jaxmotor.diagnosis._experiment import Experiment as Experiment
from jaxmotor.diagnosis._found_effect import Alternative as Alternative
from jaxmotor.diagnosis._found_effect import FoundEffect as FoundEffect
from jaxmotor.diagnosis._json import to_json as to_json
from jaxmotor.diagnosis._learned_law import LearnedLaw as LearnedLaw
from jaxmotor.diagnosis._learned_law import Resemblance as Resemblance
from jaxmotor.diagnosis._loops import LoopGain as LoopGain
from jaxmotor.diagnosis._request import Progress as Progress
from jaxmotor.diagnosis._residual_dependence import Dependence as Dependence
from jaxmotor.diagnosis._residual_dependence import dependences as dependences
from jaxmotor.diagnosis._residual_voltage import ResidualVoltage as ResidualVoltage
from jaxmotor.diagnosis._residual_voltage import residual_voltage as residual_voltage
