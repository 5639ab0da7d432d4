"""Where the simulation fails, why, and what a longer model is worth."""

from jaxmotor.diagnosis._diagnose import diagnose as diagnose
from jaxmotor.diagnosis._diagnosis import Diagnosis as Diagnosis
from jaxmotor.diagnosis._diagnosis import FoundEffect as FoundEffect
from jaxmotor.diagnosis._diagnosis import Intervals as Intervals
from jaxmotor.diagnosis._diagnosis import Rival as Rival
from jaxmotor.diagnosis._diagnosis import Worth as Worth
from jaxmotor.diagnosis._experiment import Experiment as Experiment
from jaxmotor.diagnosis._extended import extended_model as extended_model
from jaxmotor.diagnosis._json import to_json as to_json
from jaxmotor.diagnosis._learned_law import LearnedLaw as LearnedLaw
from jaxmotor.diagnosis._learned_law import Resemblance as Resemblance
from jaxmotor.diagnosis._looks import Look as Look
from jaxmotor.diagnosis._looks import looks as looks
from jaxmotor.diagnosis._loops import LoopGain as LoopGain
from jaxmotor.diagnosis._missing import MissingVolts as MissingVolts
from jaxmotor.diagnosis._missing import missing_volts as missing_volts
from jaxmotor.diagnosis._request import Progress as Progress
