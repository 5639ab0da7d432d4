"""Figures for print and screen, one function each, and how they are written."""

from jaxmotor.present._encoder import encoder as encoder
from jaxmotor.present._save import save as save
