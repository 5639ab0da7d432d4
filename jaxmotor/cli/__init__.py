"""The command line. Nothing imports it; it alone prints."""

from jaxmotor.cli._main import main as main
