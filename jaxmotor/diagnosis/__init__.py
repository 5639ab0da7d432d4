"""Where the simulation fails, and what that looks like."""

from jaxmotor.diagnosis._diagnose import diagnose as diagnose
from jaxmotor.diagnosis._diagnosis import Diagnosis as Diagnosis
from jaxmotor.diagnosis._diagnosis import to_json as to_json
from jaxmotor.diagnosis._looks import Look as Look
from jaxmotor.diagnosis._looks import looks as looks
from jaxmotor.diagnosis._missing import MissingVolts as MissingVolts
from jaxmotor.diagnosis._missing import missing_volts as missing_volts
