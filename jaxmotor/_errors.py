"""The one exception that a user meets as a sentence."""


class JaxmotorError(Exception):
    """What is wrong, where, and what to do, in one sentence; the command line prints it and exits with 1."""
