"""The one-pass recursion against the dense matrix."""

import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from jaxmotor.estimate._whitening import whiten

pytestmark = pytest.mark.usefixtures("x64")


@given(st.floats(1e-9, 1e3), st.integers(0, 2**30), st.booleans())
@settings(max_examples=40)
def test_whitening_is_the_inverse_cholesky_factor(q, seed, gaps):
    rng = np.random.default_rng(seed)
    valid = rng.uniform(size=24) > (0.2 if gaps else -1.0)
    begins = np.concatenate([[True], ~valid[:-1]]) | (rng.uniform(size=24) < (0.1 if gaps else 0.0))
    columns = rng.normal(size=(24, 3))
    variance = 1 / 6 + q
    white, log_det = whiten(*map(jnp.asarray, (columns, begins, valid, variance, 1 / 12)))

    kept = np.flatnonzero(valid)
    covariance = variance * np.eye(len(kept))
    for i in range(1, len(kept)):
        if not begins[kept[i]]:
            covariance[i, i - 1] = covariance[i - 1, i] = -1 / 12
    expected = np.linalg.solve(np.linalg.cholesky(covariance), columns[kept])
    np.testing.assert_allclose(np.asarray(white)[kept], expected, rtol=1e-9, atol=1e-12)
    assert not np.asarray(white)[~valid].any()
    assert log_det == pytest.approx(np.linalg.slogdet(covariance)[1], rel=1e-9, abs=1e-9)


def test_without_a_process_term_differences_are_positions_with_a_free_offset():
    rng = np.random.default_rng(0)
    position = rng.normal(size=(50, 2))
    differences = np.diff(position, axis=0)
    begins = np.zeros(49, bool)
    begins[0] = True
    white, _ = whiten(*map(jnp.asarray, (differences, begins, np.ones(49, bool), 1 / 6, 1 / 12)))
    centred = position - position.mean(0)
    np.testing.assert_allclose(np.asarray(white).T @ white, 12 * centred.T @ centred, rtol=1e-10)
