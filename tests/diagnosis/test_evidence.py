"""Evidence by blocks left out: against true refits, and against what is known of autoregressions."""

import numpy as np
import pytest
from scipy.signal import lfilter

from jaxmotor.diagnosis._evidence import (
    BLOCKS,
    FINEST,
    WORST,
    Evidence,
    beyond_noise,
    beyond_others,
    blocks_of,
    evidence,
    groups_of,
    means,
    weights,
)
from jaxmotor.diagnosis._free import layout_of, linear_of
from jaxmotor.diagnosis._solve import Fitted
from jaxmotor.prediction import autoregression, k_steps, one_step

ROWS = 600


def linear_fit(rng: np.random.Generator, rows: int = ROWS) -> tuple[Fitted, np.ndarray, np.ndarray]:
    """A least squares problem with the priors of a motor, its data and its columns."""
    layout = layout_of(())
    columns = rng.standard_normal((rows, len(layout.names))) * np.array([3.0, 1.0, 1e4, 5.0])
    data = columns @ np.array([1.0, -2.0, 1e-4, 0.1]) + rng.standard_normal(rows)
    free = solution(columns, data)
    fitted = Fitted(linear_of(10.0, 20.0), free, np.zeros(1), columns @ free - data, columns, True)
    return fitted, columns, data


def solution(columns: np.ndarray, data: np.ndarray) -> np.ndarray:
    layout = layout_of(())
    weight = np.where(np.isfinite(layout.spread), 1 / layout.spread, 0.0)
    both = np.vstack([columns, np.diag(weight)])
    return np.linalg.lstsq(both, np.concatenate([data, weight * layout.prior]), rcond=None)[0]


def test_a_left_out_block_is_predicted_as_a_true_refit_would():
    fitted, columns, data = linear_fit(np.random.default_rng(3))
    block = blocks_of(ROWS)
    found = evidence(fitted.residual, fitted.jacobian, fitted.layout.spread, np.zeros(ROWS, int)).squares[0]
    for number in range(block[-1] + 1):
        own = block == number
        free = solution(columns[~own], data[~own])
        error = np.mean((columns[own] @ free - data[own]) ** 2)
        assert found[number] == pytest.approx(error, rel=1e-6)


def test_a_block_that_alone_shows_a_parameter_does_not_count_without_limit():
    fitted, columns, _ = linear_fit(np.random.default_rng(4))
    columns[blocks_of(ROWS) != 2, 1] = 0.0
    found = evidence(fitted.residual, fitted.jacobian, fitted.layout.spread, np.zeros(ROWS, int)).squares[0, 2]
    assert found <= WORST * np.mean(fitted.residual[blocks_of(ROWS) == 2] ** 2) * (1 + 1e-9)


def test_close_rows_are_judged_together_and_never_across_pieces():
    piece = np.repeat([0, 1, 2], [4000, 3001, 5000])
    group = groups_of(piece, 4.5 * FINEST)
    assert np.all(np.diff(group) >= 0) and all(len(set(piece[group == own])) == 1 for own in range(group[-1] + 1))
    assert set(np.bincount(group)) == {4, 1} and group[-1] + 1 == 1000 + 751 + 1250
    columns = np.random.default_rng(6).standard_normal((len(piece), 3))
    averaged = means(columns, group)
    assert averaged.shape == (group[-1] + 1, 3) and averaged[1000] == pytest.approx(columns[4000:4004].mean(axis=0))
    # A log that is sampled as usual, and one that would have too few rows left, stay as they are.
    for same in (groups_of(piece, 1.9 * FINEST), groups_of(piece[: 20 * BLOCKS], 1e6)):
        assert np.array_equal(same, np.arange(len(same)))


def test_how_fast_a_log_was_sampled_matters_little():
    """The noise of a sensor that is sampled ten times as often, and the same motion: the evidence is the same."""
    rng = np.random.default_rng(7)
    slow = lfilter([1.0], [1.0, -0.9], rng.standard_normal(3000))
    law = np.repeat(np.sin(np.arange(3000) / 30), 10)
    smooth = np.interp(np.arange(30_000), np.arange(3000) * 10 + 4.5, slow)

    def apart(residuals: list[np.ndarray], group: np.ndarray) -> float:
        piece, free = np.zeros(group[-1] + 1, int), np.zeros((group[-1] + 1, 0))
        judged = [evidence(means(one, group), free, np.zeros(0), piece) for one in residuals]
        return float(weights(judged, [0.0, 0.0])[1])

    one, other = smooth, smooth + law
    together, alone = groups_of(np.zeros(30_000, int), 10.0 * FINEST), np.arange(30_000)
    sampled = apart([slow, slow + law[::10]], np.arange(3000))
    assert abs(np.log(apart([one, other], together) / sampled)) < abs(np.log(apart([one, other], alone) / sampled))


def test_colour_is_found_and_taken_out():
    rng = np.random.default_rng(5)
    true = np.array([1.2, -0.5])
    noise = np.asarray(lfilter([1.0], [1.0, *-true], rng.standard_normal(20_000)))
    piece = np.zeros(len(noise), int)
    found = autoregression(noise, piece)
    assert len(found.weights) == 2
    assert found.weights == pytest.approx(true, abs=0.03)
    new = one_step(noise[:, None], found.weights, piece)[:, 0]
    assert new.std() == pytest.approx(1.0, abs=0.02)
    assert np.corrcoef(new[1:], new[:-1])[0, 1] == pytest.approx(0.0, abs=0.03)


@pytest.mark.parametrize("steps", [1, 3, 20])
def test_the_error_of_a_prediction_some_rows_ahead_has_the_variance_it_should(steps):
    rng, keep = np.random.default_rng(6), 0.8
    noise = np.asarray(lfilter([1.0], [1.0, -keep], rng.standard_normal(40_000)))[:, None]
    piece, colour = np.zeros(len(noise), int), np.array([keep])
    ahead = k_steps(one_step(noise, colour, piece), colour, piece, steps)
    assert ahead[100:].var() == pytest.approx((1 - keep ** (2 * steps)) / (1 - keep**2), rel=0.05)


def test_pieces_know_nothing_of_each_other():
    rng = np.random.default_rng(7)
    noise, piece = rng.standard_normal((40, 1)), np.repeat([0, 1], 20)
    colour = np.array([0.5, 0.2])
    parts = [one_step(noise[piece == k], colour, np.zeros(20, int)) for k in (0, 1)]
    assert one_step(noise, colour, piece) == pytest.approx(np.concatenate(parts))


def test_the_simpler_of_two_equal_models_is_more_likely_and_a_better_one_wins():
    squares = np.abs(np.random.default_rng(8).standard_normal((3, 30))) + 1.0
    equal = weights([Evidence(squares), Evidence(squares)], [0.0, 1.5])
    assert equal == pytest.approx(np.array([1.0, np.exp(-1.5)]) / (1 + np.exp(-1.5)))
    better = weights([Evidence(squares), Evidence(0.5 * squares)], [0.0, 1.5])
    assert better[1] > 0.999
    # One block of thirty that is better proves nothing.
    once = squares.copy()
    once[:, 4] *= 0.5
    assert weights([Evidence(squares), Evidence(once)], [0.0, 1.5])[0] > 0.6


def test_a_model_that_hardly_anything_speaks_for_does_not_decide_between_two_others():
    """A third one predicts best, and costs most: one of the others is a little worse in each block, the other one much
    worse in some and better in the rest. Nearly all that tells them apart is their difference."""
    rng = np.random.default_rng(11)
    squares = 1 + 0.001 * rng.standard_normal((3, 30))
    even, uneven = squares * np.exp(0.03), squares * np.exp(np.where(np.arange(30) < 4, 0.9, -0.03))
    two = [Evidence(even), Evidence(uneven)]
    alone = weights(two, [4.0, 1.0])
    both = weights([*two, Evidence(squares)], [4.0, 1.0, 12.0])
    assert both[2] < 0.02
    assert both[1] / both[0] == pytest.approx(alone[1] / alone[0], rel=0.05)


def test_a_block_beyond_the_known_noise_decides_where_the_other_model_leaves_nothing_else():
    """Of thirty blocks one shows a law, which takes a tenth of the residual away."""
    rng = np.random.default_rng(9)
    squares = 1 + 0.02 * rng.standard_normal((3, 30))
    linear = squares.copy()
    linear[:, 11] += 4.0
    both = [Evidence(linear, 20_000), Evidence(squares, 20_000)]
    assert weights(both, [0.0, 1.5])[0] > 0.2
    assert weights(both, [0.0, 1.5], beyond_noise(both, [False, True]))[0] < 1e-6
    # Where the law does not explain the rest either, or where next to nothing is between them, blocks decide as before.
    assert weights(both, [0.0, 1.5], beyond_noise(both, [False, False])) == pytest.approx(weights(both, [0.0, 1.5]))
    near = [Evidence(1.05 * squares, 20_000), Evidence(squares, 20_000)]
    assert weights(near, [0.0, 1.5], beyond_noise(near, [False, True])) == pytest.approx(weights(near, [0.0, 1.5]))


def test_two_blocks_decide_by_rows_where_the_noise_is_as_the_log_says_and_one_does_not():
    rng = np.random.default_rng(10)
    squares = 1 + 0.02 * rng.standard_normal((3, 30))
    once, twice = squares.copy(), squares.copy()
    once[:, 11] += 4.0
    twice[:, [11, 19]] += 2.0
    for linear, low, high in ((once, 0.2, 1.0), (twice, 0.0, 1e-6)):
        both = [Evidence(linear, 20_000), Evidence(squares, 20_000)]
        assert weights(both, [0.0, 1.5])[0] > 0.2
        assert low <= weights(both, [0.0, 1.5], beyond_others(both, [1.1, 0.95]))[0] <= high
    # A law that takes next to nothing of chi2 up is no more likely by it.
    assert beyond_others(both, [1.1, 1.05]) == pytest.approx([0.0, 0.0])
