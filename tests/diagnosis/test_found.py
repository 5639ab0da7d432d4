"""When a motor leaves nothing unexplained."""

import dataclasses

import numpy as np
import pytest
from test_evidence import linear_fit

from jaxmotor.diagnosis._found import EXPLAINED, INEXACT, Explained


def leaving(chi2):
    """A motor without effects whose residual has that mean square."""
    fitted, _, _ = linear_fit(np.random.default_rng(1))
    return dataclasses.replace(fitted, residual=np.sqrt(chi2) * np.ones(600))


@pytest.mark.parametrize(
    ("noise_known", "chi2", "holds"),
    [(True, 1.1, True), (True, 1.2, False), (False, 1.1, True), (False, 8.0, True), (False, 10.0, False)],
)
def test_without_a_known_noise_laws_need_not_be_more_exact_than_they_are(noise_known, chi2, holds):
    assert Explained(1e4, noise_known).holds(leaving(chi2)) is holds


def test_the_share_that_is_left_is_that_beyond_what_is_enough():
    known, unknown = Explained(1e4, noise_known=True), Explained(1e4, noise_known=False)
    assert known.share_left(leaving(101.0), 1e4) == pytest.approx((101 - EXPLAINED) / (1e4 - 1))
    assert unknown.share_left(leaving(101.0), 1e4) == pytest.approx((101 - INEXACT**2 * 1e4) / (1e4 - 1))
    assert unknown.share_left(leaving(5.0), 1e4) == 0.0
    assert known.share_left(leaving(50.0), 20.0) == 1.0
