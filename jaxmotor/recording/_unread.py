"""Rows whose input is known and whose shaft was not read: they hold what was applied, and nothing to compare with."""

import numpy as np


def between(known: np.ndarray, read: np.ndarray, begins: np.ndarray) -> np.ndarray:
    """(n,) the rows to keep: those that are `known`, from the first one that was `read` to the last one in each run of
    known rows. `begins` are first rows of segments."""
    run = np.cumsum(~known | begins)
    first, last = np.searchsorted(run, run), np.searchsorted(run, run, side="right") - 1
    whole = known & read
    number = np.cumsum(whole)
    return known & (number > (number - whole)[first]) & (number - whole < number[last])


def are_far_apart(read: np.ndarray) -> bool:
    """Most of the rows that were `read` (n,) have no other beside them: turns from row to row are not known."""
    return bool(2 * np.count_nonzero(read[1:] & read[:-1]) < np.count_nonzero(read) - 1)


def filled(column: np.ndarray, time_s: np.ndarray, unread: np.ndarray) -> np.ndarray:
    """(n,) `column`, with what lies between the readings beside them at rows that are `unread`; one must not be."""
    return np.where(unread, np.interp(time_s, time_s[~unread], column[~unread]), column)
