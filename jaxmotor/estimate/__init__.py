"""From recordings to motors: sine fit, response fit, trajectory fit, and how sure each is."""

from jaxmotor.estimate._electrical import electrical_check as electrical_check
from jaxmotor.estimate._fingerprint import fingerprint as fingerprint
from jaxmotor.estimate._fit import Fit as Fit
from jaxmotor.estimate._fit import Trace as Trace
from jaxmotor.estimate._frequency_response import FrequencyResponse as FrequencyResponse
from jaxmotor.estimate._identify import as_problem as as_problem
from jaxmotor.estimate._identify import identify as identify
from jaxmotor.estimate._judge import student_t as student_t
from jaxmotor.estimate._lanes import Packed as Packed
from jaxmotor.estimate._lanes import bucket as bucket
from jaxmotor.estimate._lanes import pack as pack
from jaxmotor.estimate._lanes import pieces_of as pieces_of
from jaxmotor.estimate._model_file import Model as Model
from jaxmotor.estimate._model_file import model_of as model_of
from jaxmotor.estimate._model_file import read_model as read_model
from jaxmotor.estimate._model_file import to_json as to_json
from jaxmotor.estimate._response_fit import fit_response as fit_response
from jaxmotor.estimate._sine_fit import fit_phasors as fit_phasors
from jaxmotor.estimate._traces import fit_percent as fit_percent
from jaxmotor.estimate._traces import traces_of as traces_of
from jaxmotor.estimate._trajectory import Problem as Problem
from jaxmotor.estimate._trajectory import motor_of as motor_of
from jaxmotor.estimate._trajectory import predict as predict
from jaxmotor.estimate._trajectory import start_columns as start_columns
