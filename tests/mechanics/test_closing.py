"""The coordinate that closes a contact while another quantity of its mechanism changes."""

import numpy as np
import pytest

from asympk.errors import InputError, NotDerivable
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
BLOCK = {"coordinates": ["X", "q"], "lagrangian": "(X'^2 + q'^2)/2", "slip": "X + q", "friction": "f",
         "values": {"f": 3, "p": 0}, "state": {"X": 0, "q": 0, "X'": 1, "q'": 0}}


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


@pytest.mark.slow
def test_a_place_out_of_reach_is_refused_by_name_and_all_else_is_told():
    """Nothing was told of a crank longer than its rod."""
    short = mechanism_of_table({**CRANK, "values": {"l": 0.9, "f": 3}, "over": {"theta": [0.05, 2]}}, "crank")
    with pytest.raises(NotDerivable, match=r"no phi closes the contact at theta = 1\.1\d+: give a range of theta"):
        _ = short.tied
    told = mechanism_as_text(short)
    assert "over theta      no phi closes the contact at theta = 1.1" in told
    assert "rigid motions   none" in told
    assert "impulses P_N" in told


def test_an_example_that_nothing_closes_is_told_by_its_place():
    """The refusal was `b[0] = nan: it must be a finite number`."""
    told = mechanism_as_text(described_mechanism("arm").changed({"a": 3}))
    assert "over a          no b closes the contact at a = 3: give a range of a" in told
    assert "--plot" not in told  # a map over this range is refused


def test_a_height_without_a_part_in_the_paradox_closes_the_contact_and_leaves_every_interval_found():
    rod = described_mechanism("painleve_rod")
    assert rod.tied["Y"](np.array([0.3, 1.1])) == pytest.approx(np.sin([0.3, 1.1]), abs=1e-15)
    assert "as far as samples tell" not in mechanism_as_text(rod)


def test_no_coordinate_closes_the_contact_over_a_friction():
    assert mechanism_of_table({**CRANK, "over": {"f": [0, 3]}}, "crank").tied == {}


def test_a_contact_that_turns_back_is_not_followed_onto_a_root_beyond():
    """g_q has the same sign at the root up to p = 1.30 and at a root beyond, which was taken for it."""
    gap = "8*p*q/15 + sin(q) - 3*cos(p) + 3.14305"
    turned = {**BLOCK, "gap": gap, "values": {"f": 3, "p": -0.335357}, "state": {**BLOCK["state"], "q": -0.298032}}
    with pytest.raises(NotDerivable, match=r"no q closes the contact at p = 1\.30"):
        _ = mechanism_of_table({**turned, "over": {"p": [15, 16.4]}}, "turned").tied


def test_over_ten_turns_a_rod_little_longer_than_its_crank_closes_the_contact():
    crank = mechanism_of_table({**CRANK, "values": {"l": 1.01, "f": 3}, "over": {"theta": [0, 63]}}, "crank")
    at = np.linspace(0, 63, 2001)
    assert crank.tied["phi"](at) == pytest.approx(np.arcsin(np.sin(at) / 1.01), abs=1e-9)


def test_a_crank_as_long_as_its_rod_closes_the_contact_up_to_the_place_where_two_ways_part():
    level = {**CRANK, "values": {"l": 1, "f": 3}, "state": {**CRANK["state"], "phi": 1}}
    at = np.linspace(0, np.pi / 2, 9)
    crank = mechanism_of_table({**level, "over": {"theta": [0, np.pi / 2]}}, "crank")
    assert crank.tied["phi"](at) == pytest.approx(at, abs=1e-6)


def test_a_contact_along_a_sharp_bend_is_followed_over_it():
    cam = mechanism_of_table({**BLOCK, "values": {"f": 3}, "gap": "X - 3*q - 2*Abs(q)", "over": {"X": [-1, 1]}}, "cam")
    assert cam.tied["q"](np.array([-1, 0, 1])) == pytest.approx([-1, 0, 0.2], abs=1e-14)


def test_the_height_of_a_hinge_that_is_not_in_the_paradox_closes_the_contact_of_a_brake_shoe():
    assert "over theta      a paradox in 0.05 .. 1.17601" in mechanism_as_text(described_mechanism("brake_shoe"))


def test_a_gap_of_the_turned_coordinate_alone_is_refused():
    """The paradox was told along an open contact, without a word of it."""
    block = {**BLOCK, "values": {"f": 3}, "gap": "X", "slip": "q + X*q", "over": {"X": [-1, 1]}}
    with pytest.raises(InputError, match="the contact opens where X changes, and no other coordinate closes it"):
        mechanism_as_text(mechanism_of_table(block, "own"))


@pytest.mark.slow
def test_friction_that_depends_on_the_sliding_velocity_is_that_of_the_example_over_an_angle():
    """With the rates held, the closed contact did not keep its velocity, and no paradox was told."""
    gamma = -np.sin(1) - 1.2 * np.sin(0.777115) * 0.631543
    falling = {**CRANK, "friction": "f/(1 + (sin(theta)*theta' + l*sin(phi)*phi')^2)"}
    constant = {**CRANK, "values": {"l": 1.2, "f": float(3 / (1 + gamma**2))}}
    one, other = (mechanism_as_text(mechanism_of_table(table, "crank")) for table in (falling, constant))
    where = "over theta      a paradox in 1.52934 .. 2.11798, within 0.05 .. 3"
    assert (where in one, where in other) == (True, True)
    assert ("sliding as here" in one, "sliding as here" in other) == (True, False)
