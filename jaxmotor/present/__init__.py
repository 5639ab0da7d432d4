"""Figures for print and screen, one function each, and how they are written.

Each draws a figure of its own, or on the `axes` that it is given (one for each panel, row by row), and returns the
figure that it drew on.
"""

from jaxmotor.present._autocorrelation import autocorrelation as autocorrelation
from jaxmotor.present._before_after import before_after as before_after
from jaxmotor.present._before_after import loop_before_after as loop_before_after
from jaxmotor.present._bode import bode as bode
from jaxmotor.present._bode import bode_models as bode_models
from jaxmotor.present._causes import causes as causes
from jaxmotor.present._causes import probabilities as probabilities
from jaxmotor.present._encoder import encoder as encoder
from jaxmotor.present._fit import residuals as residuals
from jaxmotor.present._fit import simulation as simulation
from jaxmotor.present._folder import diagnosis_figures as diagnosis_figures
from jaxmotor.present._folder import fit_figures as fit_figures
from jaxmotor.present._folder import picture as picture
from jaxmotor.present._folder import write_diagnosis as write_diagnosis
from jaxmotor.present._folder import write_fit as write_fit
from jaxmotor.present._folder import write_validation as write_validation
from jaxmotor.present._learned import learned as learned
from jaxmotor.present._overview import overview as overview
from jaxmotor.present._population import population_figure as population_figure
from jaxmotor.present._residual_voltage import residual_voltage as residual_voltage
from jaxmotor.present._save import save as save
from jaxmotor.present._sine import position_drift as position_drift
from jaxmotor.present._sine import sine_fit as sine_fit
from jaxmotor.present._validation import Compared as Compared
from jaxmotor.present._validation import closed_loop as closed_loop
from jaxmotor.present._validation import controller as controller
from jaxmotor.present._validation import step as step
from jaxmotor.present._validation import step_trials as step_trials
from jaxmotor.present._zoh import zoh_bode as zoh_bode
