"""The automaton of a scene: of the scene's system, or of the Painlevé-Klein rod for a scene without a system."""

from typing import Any

from asympk.automaton.automaton import Automaton


def automaton_of(scene: Any) -> Automaton:
    """Return the ``Automaton`` of a scene, with numbers for its parameters, as they stand inside of powers, too."""
    if scene.system is not None:
        return Automaton.at(scene.system, scene.values)
    from asympk.systems import painleve_klein as pk

    system = pk.system()
    given = {pk.mu: scene.mu, pk.sigma: scene.sigma, pk.sigma0: scene.sigma0}
    return Automaton(system, tuple(given[s] for s in system.parameters))
