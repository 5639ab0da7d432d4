import pytest

from jaxmotor.recording import ranges


@pytest.mark.parametrize(
    "indices, text",
    [
        ([], ""),
        ([4], "4"),
        ([4, 7], "4, 7"),
        ([0, 1, 2, 3, 7], "0-3, 7"),
        ([1, 3, 5], "1, 3, 5"),
        ([1, 3, 5, 7, 9, 10, 11], "1, 3, ..., 9, 10-11"),
        ([0, 2, 3, 4, 8], "0, 2-4, 8"),
    ],
)
def test_indices_as_a_person_writes_them(indices, text):
    assert ranges(indices) == text
