"""The automaton of a scene: of the scene's system, or of the Painlevé-Klein rod for a scene without a system."""

from typing import Any

from asympk.automaton.automaton import Automaton
from asympk.symbolic.placing import with_numbers_in_exponents


def automaton_of(scene: Any) -> Automaton:
    """Return the ``Automaton`` that a scene follows, with the scene's numbers for its parameters, also in exponents."""
    if scene.system is not None:
        return Automaton(*with_numbers_in_exponents(scene.system, scene.values))
    from asympk.systems import painleve_klein as pk

    system = pk.system()
    given = {pk.mu: scene.mu, pk.sigma: scene.sigma, pk.sigma0: scene.sigma0}
    return Automaton(system, tuple(given[s] for s in system.parameters))
