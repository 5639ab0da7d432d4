"""When a motor leaves nothing unexplained."""

import dataclasses

import numpy as np
import pytest
from test_evidence import linear_fit

from jaxmotor.diagnosis._found import EXPLAINED, INEXACT, LAW_OFF, NEARLY, OFF, Explained
from jaxmotor.diagnosis._free import with_effect
from jaxmotor.motor.effects import Backlash


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


def test_where_little_is_to_be_explained_little_may_be_left():
    """Beside the noise's scatter, of which no more than 6 % is known here, and 30 % there: an encoder that repeats."""
    known, repeats = Explained(1.6, noise_known=True), Explained(1.6, noise_known=True, noise=1.3)
    assert known.holds(leaving(1.14)) and known.share_left(leaving(1.05), 1.6) == 0.0
    assert known.share_left(leaving(1.14), 1.6) == pytest.approx((1.14 - NEARLY - 0.6 * OFF) / 0.6)
    assert repeats.share_left(leaving(1.14), 1.6) == 0.0
    assert Explained(1.6, noise_known=False).share_left(leaving(1.14), 1.6) == 0.0


@pytest.mark.usefixtures("x64")
def test_a_law_that_is_inexact_is_not_so_for_all_that_there_is():
    loose, gap = leaving(1.4), Backlash.of(gap_rad=0.01, inertia_ratio=0.1)
    loose = dataclasses.replace(loose, template=with_effect(loose.template, gap))
    much, little = Explained(20.0, noise_known=True), Explained(1.44, noise_known=True)
    assert much.holds(loose) and much.share_left(loose, 20.0) == 0.0
    assert not little.holds(loose)
    assert little.share_left(loose, 1.44) == pytest.approx((1.4 - NEARLY - 0.44 * LAW_OFF) / 0.44)
