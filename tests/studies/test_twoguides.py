"""Two contacts at once: Newton's law of the second mass, the rod with one rough guide as a limit, every integrator."""

import pytest
import sympy as sp
from peers import here

import asympk as ap
from asympk.studies import twoguides
from asympk.systems import painleve_klein as pk


def test_the_second_mass_feels_the_rod_and_its_own_friction_alone():
    system = twoguides.system()
    gained = system.slow[pk.z] - system.fast[pk.y]
    assert sp.expand(gained - (pk.x + pk.y + twoguides.phi_2)) == 0


def test_with_a_second_guide_that_is_nearly_smooth_the_rod_moves_as_with_one():
    rod = ap.solve(ap.Scene(sigma=1, mu="1e-3", start=twoguides.START, until=twoguides.UNTIL)).final
    smooth = twoguides.scene("1e-3", second="1e-10")
    found = dict(zip(smooth.names, ap.solve(smooth).final, strict=True))
    assert [found[name] for name in "xyz"] == pytest.approx(rod, abs=1e-8)


@pytest.mark.parametrize("method", ["rk45", "radau", "bdf", "lsoda", *here("heyoka", "cvode")])
@pytest.mark.few(2)
def test_every_integrator_sees_the_events_of_both_contacts(method):
    scene = twoguides.scene("1e-2")
    path, exact = ap.solve(scene, method=method, rtol=1e-8, atol=1e-8), ap.solve(scene)
    assert [(e.kind, e.friction) for e in path.events] == [(e.kind, e.friction) for e in exact.events]
    assert path.modes == exact.modes
    assert path.final == pytest.approx(exact.final, abs=1e-6)
