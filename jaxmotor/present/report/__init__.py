"""One HTML file that tells what was found out of a motor, or of a fleet of them, and needs nothing else."""

from jaxmotor.present.report._fleet_page import fleet_page as fleet_page
from jaxmotor.present.report._fleet_page import write_fleet_page as write_fleet_page
from jaxmotor.present.report._report import report_page as report_page
from jaxmotor.present.report._report import write_report as write_report
from jaxmotor.present.report._story import Story as Story
from jaxmotor.present.report._story import held_out_runs as held_out_runs
from jaxmotor.present.report._story import story as story
