"""Laws that may hide beside a linear motor, to first order: those that the recording shows, and each other beside them.

With J the whitened columns of ψ, H those of the laws and e the whitened residual, H' = H - J (JᵀJ)⁻¹ Jᵀ H is what ψ
cannot do, and the amounts c of some laws at once solve (H'ᵀ H') c = H'ᵀ e. A law is shown where it lowers the sum of
squares by more than chance does: the one that lowers it most is let in first, the next beside it. No amount is below
none.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from jaxmotor._balanced import solve_balanced
from jaxmotor.estimate._trajectory import Solution
from jaxmotor.estimate._uncertainty import HIDDEN, MOST, Uncertainty

DAMPING = 1e-9
"""Of the equations in amounts, in units of their diagonal: laws that are not told from each other share an amount."""
ENDLESS = 2.0
"""Degrees of freedom up to which Student's t has no variance: one or two blocks tell nearly all, and how they disagree
says nothing."""


class Hidden(NamedTuple):
    """One law beside a motor, to first order."""

    name: str
    amount: float
    """That fits best [`UNITS`]."""
    error: float
    """Its standard error."""
    shift: np.ndarray
    """(2,) of the logarithms of gain and pole for one unit, laws that are shown at their best for it."""
    alone: np.ndarray
    """(2,) the same with those as they are."""


class Beside(NamedTuple):
    """What may hide beside a motor."""

    shown: tuple[Hidden, ...]
    """Laws that the recording shows, or others like them: each with the rest of them at their best, the one that
    explains most first."""
    others: tuple[Hidden, ...]
    """Each alone beside those."""


def student_t(freedom: float) -> float:
    """Quantile 0.975 of Student's t, of at least one degree of freedom."""
    from scipy.special import stdtrit

    return float(stdtrit(max(freedom, 1.0), 0.975))


def hidden_laws(solution: Solution, errors: Uncertainty, by_chance: float, colour: float, quiet: bool) -> Beside:
    """`HIDDEN` beside the linear motor of `solution`.

    `by_chance` is how far a law lowers the sum of squares, in variances, where there is none; of coloured noise
    `colour` rows are worth one; where the residual is `quiet` it is the noise alone.
    """
    laws = _Laws(solution, errors, colour, quiet)
    shown = laws.shown(by_chance)
    wider = laws.wider(float(errors.chi2), shown)
    return Beside(
        tuple(laws.beside(law, [one for one in shown if one != law], wider) for law in shown),
        tuple(laws.beside(law, shown, wider) for law in range(len(HIDDEN)) if law not in shown),
    )


class _Laws:
    """Equations in the amounts of `HIDDEN`."""

    def __init__(self, solution: Solution, errors: Uncertainty, colour: float, quiet: bool):
        self.score = np.asarray(errors.hidden_score)
        self.information = np.asarray(errors.hidden_information)
        self.white = np.asarray(errors.hidden_error)
        self.square, self.colour, self.quiet = float(errors.hidden_square), colour, quiet
        self.whole = self.information.sum(0)
        # A column that ψ can do but for rounding errors has a least square, by which its error is huge.
        own = np.diag(self.whole)
        self.variance = float(np.median(self.white**2 * np.where(own > 0, own, 1.0)))
        np.fill_diagonal(self.whole, np.maximum(own, self.variance / self.white**2))
        scale = np.array([float(solution.psi[0]), 1.0])[:, None]
        self.shift = np.asarray(errors.hidden_shift)[[0, 2]] / scale

    def together(self, laws: Sequence[int]) -> tuple[np.ndarray, float]:
        """Amounts of `laws`, and by how much they lower the sum of squares."""
        score = self.score.sum(0)[list(laws)]
        amounts = solve_balanced(self.whole[np.ix_(laws, laws)], score, DAMPING)
        return amounts, float(score @ amounts)

    def shown(self, by_chance: float) -> list[int]:
        """Laws that lower the sum of squares by more than chance does, one after the other."""
        found: list[int] = []
        lowered = 0.0
        while True:
            tried = [(law, *self.together([*found, law])) for law in range(len(HIDDEN)) if law not in found]
            drops = {law: drop for law, amounts, drop in tried if (amounts > 0).all()}
            best = max(drops, key=drops.__getitem__, default=None)
            if best is None or drops[best] - lowered <= by_chance * self.variance:
                return found
            found, lowered = [*found, best], drops[best]

    def wider(self, chi2: float, shown: Sequence[int]) -> float:
        """What the motor leaves beside the noise and the laws `shown` is no chance: it biases what is taken to first
        order."""
        return max(chi2 * (1 - self.together(shown)[1] / self.square), 1.0)

    def beside(self, law: int, others: Sequence[int], wider: float) -> Hidden:
        """`law`, where `others` are at their best for each of its amounts."""
        laws = [law, *others]
        amounts, _ = self.together(laws)
        shift = self.shift[:, laws] @ self._along(law, others)
        return Hidden(HIDDEN[law], float(amounts[0]), self._error(laws, amounts) * wider, shift, self.shift[:, law])

    def _along(self, law: int, others: Sequence[int]) -> np.ndarray:
        """By how much the amounts of `law` and `others` change for one unit of `law`."""
        across = self.whole[np.ix_(others, [law])][:, 0]
        return np.array([1.0, *-solve_balanced(self.whole[np.ix_(others, others)], across, DAMPING)])

    def _error(self, laws: Sequence[int], amounts: np.ndarray) -> float:
        """Of the first of `laws`: of white noise, where that is left alone; else from how blocks disagree, if that is
        more."""
        first = np.eye(len(laws))[0]
        row = solve_balanced(self.whole[np.ix_(laws, laws)], first, DAMPING)
        white = float(np.sqrt(row[0] * self.variance))
        if self.quiet:
            return white
        score, information = self.score[:, laws], self.information[:, laws][:, :, laws]
        share = np.einsum("p,kpq,q->k", row, information, row) / row[0]
        square = float((share**2).sum())
        freedom, used = 1 / square - 1 if square > 0 else 0.0, share > 0
        # Where no block tells the law from the others, rounding alone is left of its share.
        if not freedom > ENDLESS or not used.any():
            return white * np.sqrt(self.colour)
        left = score - information @ amounts
        rest = self.whole[np.ix_(laws, laws)] - np.where(share > MOST, 0.0, 1.0)[:, None, None] * information
        moved = solve_balanced(rest, left, DAMPING)[:, 0]
        number = used.sum()
        about = (moved - moved.sum() / number)[used]
        blocks = np.sqrt((number - 1) / number * (about**2).sum())
        return max(white, float(blocks) * student_t(freedom) / 1.96)
