"""The coordinate that closes a contact while another quantity of its mechanism changes."""

import numpy as np
import pytest

from asympk.errors import InputError
from asympk.mechanics.described import mechanism_of_table
from asympk.output.mechanisms import mechanism_as_text
from asympk.systems.catalogue import described_mechanism

CRANK = {  # the slider-crank of the catalogue, as a file tells it
    "coordinates": ["theta", "phi"],
    "lagrangian": "theta'^2 + (sin(theta)*theta' + l*sin(phi)*phi')^2/2 + (cos(theta)*theta' - l*cos(phi)*phi')^2/2",
    "gap": "sin(theta) - l*sin(phi)", "slip": "cos(theta) + l*cos(phi)", "friction": "f", "forces": {"theta": 1},
    "values": {"l": 1.2, "f": 3}, "state": {"theta": 1, "phi": 0.777115, "theta'": 1, "phi'": 0.631543},
    "over": {"theta": [0.05, 3]},
}


@pytest.mark.slow
def test_over_an_angle_of_a_file_the_paradox_is_that_of_the_closed_contact():
    """With the rod's angle held, off the contact, there was a paradox everywhere."""
    told = mechanism_as_text(mechanism_of_table(CRANK, "crank"))
    assert "over theta      a paradox in 0.540922 .. 2.75143, within" in told
    assert "phi closes the contact" in told.replace("\n", " ")


def test_with_another_rod_the_angles_of_the_catalogue_s_crank_close_the_contact():
    at = np.linspace(0.05, 3, 7)
    for length in (1.2, 3):
        found = described_mechanism("crank_slider").changed({"l": length}).tied["phi"](at)
        assert found == pytest.approx(np.arcsin(np.sin(at) / length), abs=1e-12)


def test_a_place_out_of_reach_is_refused_by_name():
    short = mechanism_of_table({**CRANK, "values": {"l": 0.9, "f": 3}, "over": {"theta": [0.05, 2]}}, "crank")
    with pytest.raises(InputError, match=r"no phi closes the contact at theta = 1\.1\d+: give a range of theta"):
        mechanism_as_text(short)


def test_a_height_without_a_part_in_the_paradox_closes_the_contact_and_leaves_every_interval_found():
    rod = described_mechanism("painleve_rod")
    assert rod.tied["Y"](np.array([0.3, 1.1])) == pytest.approx(np.sin([0.3, 1.1]), abs=1e-15)
    assert "as far as samples tell" not in mechanism_as_text(rod)


def test_no_coordinate_closes_the_contact_over_a_friction():
    assert mechanism_of_table({**CRANK, "over": {"f": [0, 3]}}, "crank").tied == {}
