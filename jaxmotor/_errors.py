"""The one exception that a user meets as a sentence."""

from jaxmotor._sentences import sentence


class JaxmotorError(Exception):
    """What is wrong, where, and what to do, in one sentence; the command line prints it and exits with 1.

    It is one printable line of at most 300 characters, whatever file it quotes.
    """

    def __init__(self, text: str) -> None:
        super().__init__(sentence(text))
