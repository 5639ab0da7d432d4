"""The paper's open question: its extra delay is the sum of named parts."""

import numpy as np
import pytest


@pytest.fixture(scope="module")
def parts(plant_library):
    from delay import parts

    return {friction: parts(friction) for friction in (0.0, 0.2)}


@pytest.mark.parametrize("friction", [0.0, 0.2])
def test_the_parts_add_up_to_what_is_seen(parts, friction):
    found = parts[friction]
    np.testing.assert_allclose(found.together, found.seen, atol=0.03)


def test_the_count_difference_is_nine_degrees_at_ten_hertz_and_friction_is_lead(parts):
    assert parts[0.2].difference[-1] == pytest.approx(-9.03, abs=0.02)
    assert parts[0.2].friction[-1] == pytest.approx(2.4, abs=0.1)
    assert (parts[0.2].friction > 0).all()
    np.testing.assert_allclose(parts[0.0].friction, 0.0, atol=0.02)
