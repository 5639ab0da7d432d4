"""The bench: what an encoder can tell, and the experiments that make recordings."""

from jaxmotor.bench._encoder import SpeedResolution as SpeedResolution
from jaxmotor.bench._encoder import resolution_table as resolution_table
from jaxmotor.bench._encoder import speed_resolution as speed_resolution
