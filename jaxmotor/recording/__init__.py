"""Recordings: the file format, what can be wrong with the data, and logs from elsewhere."""

from jaxmotor.recording._at_duty import at_duty as at_duty
from jaxmotor.recording._bundled import bundled as bundled
from jaxmotor.recording._check import check as check
from jaxmotor.recording._check import check_output as check_output
from jaxmotor.recording._check import lost_ticks as lost_ticks
from jaxmotor.recording._check import warn_sign as warn_sign
from jaxmotor.recording._foreign import import_log as import_log
from jaxmotor.recording._from_columns import from_columns as from_columns
from jaxmotor.recording._from_columns import header_of as header_of
from jaxmotor.recording._header import OWN_KEYS as OWN_KEYS
from jaxmotor.recording._header import Header as Header
from jaxmotor.recording._join import join as join
from jaxmotor.recording._jumps import check_jumps as check_jumps
from jaxmotor.recording._log_unit import LogUnit as LogUnit
from jaxmotor.recording._log_unit import log_unit as log_unit
from jaxmotor.recording._ranges import ranges as ranges
from jaxmotor.recording._read import read as read
from jaxmotor.recording._recording import KINDS as KINDS
from jaxmotor.recording._recording import Measured as Measured
from jaxmotor.recording._recording import Recording as Recording
from jaxmotor.recording._recording import RecordingError as RecordingError
from jaxmotor.recording._recording import Segment as Segment
from jaxmotor.recording._steady import import_steady as import_steady
from jaxmotor.recording._sysid import import_sysid as import_sysid
from jaxmotor.recording._write import to_text as to_text
from jaxmotor.recording._write import write as write
