"""The page of constants says what the sources do, and leaves none out."""

from pathlib import Path

import pytest
from constants import FOLDERS, PACKAGE, constants, page

PAGE = Path(__file__).parents[2] / "docs/constants.md"


def test_the_page_is_up_to_date():
    assert PAGE.read_text(encoding="utf-8") == page(), "python benchmarks/constants.py > docs/constants.md"


@pytest.mark.parametrize("folder", FOLDERS)
def test_every_constant_says_what_it_is(folder):
    found = list(constants(folder))
    assert found and [one.names for one in found if not one.meaning] == []
    for one in found:
        text = (PACKAGE / one.module).read_text(encoding="utf-8")
        assert all(name in text for name in one.names.split(", "))


def test_numbers_with_names_are_found_whatever_their_form():
    values = {one.names: one.value for folder in FOLDERS for one in constants(folder)}
    assert values["NAMED"] == "0.9" and values["OF_NAME, OF_FAMILY"] == "(Logistic(0.018, 1.8), Logistic(0.29, 1.2))"
    assert values["RESOLUTIONS_S"] == "(0.01, 0.001)" and values["KEPT"] == "2 / 3"
