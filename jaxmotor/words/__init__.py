"""Findings in words, as the terminal and the report tell them: each sentence is written once."""

from jaxmotor._numbers import as_known as as_known
from jaxmotor._numbers import between as between
from jaxmotor._numbers import bracket as bracket
from jaxmotor._numbers import plainly as plainly
from jaxmotor._numbers import with_bracket as with_bracket
from jaxmotor._numbers import with_error as with_error
from jaxmotor._sentences import printable as printable
from jaxmotor.estimate import allowing as allowing
from jaxmotor.words._effects import capital as capital
from jaxmotor.words._effects import law as law
from jaxmotor.words._effects import named as named
from jaxmotor.words._effects import scaled as scaled
from jaxmotor.words._effects import sentence as sentence
from jaxmotor.words._findings import LOOP as LOOP
from jaxmotor.words._findings import floor as floor
from jaxmotor.words._findings import likely as likely
from jaxmotor.words._findings import looks_like as looks_like
from jaxmotor.words._findings import loop_of as loop_of
from jaxmotor.words._findings import may_be as may_be
from jaxmotor.words._findings import noise_words as noise_words
from jaxmotor.words._findings import nothing_left as nothing_left
from jaxmotor.words._findings import of_rounding as of_rounding
from jaxmotor.words._findings import seen_in as seen_in
