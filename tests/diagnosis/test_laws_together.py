"""Two laws in one motor act on each other as they do in the plant, which is integrated finely."""

import blind
import pytest
from hidden import draw

pytestmark = pytest.mark.usefixtures("plant_library")


@pytest.mark.parametrize(
    "kinds",
    [
        ("direction_asymmetry", "supply_sag"),
        ("supply_sag", "winding_heating"),
        ("transport_delay", "winding_heating"),
        ("sensor_lag", "winding_heating"),
        ("coast_drive", "winding_heating"),
    ],
    ids="+".join,
)
def test_the_hidden_motor_explains_its_recording(kinds):
    assert blind.truth_drift(draw(kinds, 3)) < 1.1
