"""What is quoted in an error is printable and short."""

import pickle

import pytest
from hypothesis import given
from hypothesis import strategies as st

from jaxmotor import JaxmotorError
from jaxmotor._sentences import LONGEST, one_of, printable, sentence, shown


@given(st.text(), st.integers(0, 50))
def test_every_sentence_is_one_short_printable_line(text, times):
    said = str(JaxmotorError(f"m.csv: {text * times}; correct it"))
    assert len(said) <= LONGEST and said.isprintable()
    assert said.startswith("m.csv: ") and said.endswith("; correct it")
    assert sentence(said) == said


def test_a_short_sentence_is_left_alone():
    said = "m.csv, line 3: the unit Ω is not known; it is one of V, mV"
    assert str(JaxmotorError(said)) == said and str(pickle.loads(pickle.dumps(JaxmotorError(said)))) == said


@pytest.mark.parametrize(
    ("value", "said"),
    [
        ("abc", "'abc'"),
        ("\x1b[31m", "'\\x1b[31m'"),
        ("\u202eabc", "'\\u202eabc'"),
        (7, "7"),
        (10**400, "a number of some 400 digits"),
        (1 << 100_000, "a number of some 30103 digits"),
        (True, "true"),
        (None, "none"),
        (float("nan"), "nan"),
        (1e300, "1e+300"),
        ([[[[1]]]], "a list of 1"),
        ({"a": 1}, "a table"),
    ],
    ids=range(12),
)
def test_values_are_named(value, said):
    assert shown(value) == said


@given(st.recursive(st.text() | st.floats() | st.integers() | st.none() | st.booleans(), st.lists))
def test_any_value_is_short(value):
    assert len(shown(value)) <= 40 * 10 + 2 and shown(value).isprintable()


def test_of_many_names_the_nearest_are_told():
    names = [f"effect_number_{k}" for k in range(100)]
    assert one_of(["a", "b"]) == "a, b"
    assert "effect_number_42" in one_of(names, "efect_number_42") and len(one_of(names, "x" * 10_000)) <= 120


def test_control_characters_become_escapes():
    assert printable("a\x1b]0;t\x07\n") == "a\\x1b]0;t\\x07\\n"
