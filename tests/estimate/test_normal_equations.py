"""Normal equations in unknowns of any units."""

import numpy as np
import pytest

from jaxmotor._precision import to_jax
from jaxmotor.estimate import solve_normal


def equations(size, seed=0):
    """Symmetric and positive definite, of unknowns whose units differ by many powers of ten."""
    rng = np.random.default_rng(seed)
    columns = rng.normal(size=(30, size)) * 10.0 ** rng.integers(-6, 7, size)
    return columns.T @ columns


@pytest.mark.usefixtures("x64")
@pytest.mark.parametrize("size", [0, 1, 2, 6])
@pytest.mark.parametrize("columns", [(), (4,)])
def test_the_solution_is_numpys(size, columns):
    normal = equations(size)
    unit = np.sqrt(np.diag(normal)).reshape(-1, *[1] * len(columns))
    right = np.random.default_rng(1).normal(size=(size, *columns)) * unit
    found = np.asarray(solve_normal(to_jax(normal), to_jax(right)))
    assert found.shape == right.shape
    np.testing.assert_allclose(found * unit, np.linalg.solve(normal, right) * unit, rtol=1e-9, atol=1e-9)


@pytest.mark.usefixtures("x64")
def test_an_unknown_that_shows_nowhere_gets_no_step():
    normal, right = equations(4), np.ones(4)
    normal[2], normal[:, 2], right[2] = 0.0, 0.0, 0.0
    rest = np.ix_([0, 1, 3], [0, 1, 3])
    found = np.asarray(solve_normal(to_jax(normal), to_jax(right)))
    assert found[2] == 0.0
    np.testing.assert_allclose(found[[0, 1, 3]], np.linalg.solve(normal[rest], right[[0, 1, 3]]), rtol=1e-9)
