r"""The rigid mechanism as a system that runs: states are all coordinates and all velocities.

    q' = u,    u' = M^-1 (Q + sum_k W_Nk N_k + W_Tk F_k),
    0 = g_i'' = a_Ni + W_Ni' M^-1 sum_k (W_Nk N_k + W_Tk F_k)  while contact i is closed

N_k is the reaction of contact k, which the constraints determine in each mode, and F_k its friction force with the load
nu_k |N_k|. A flow stops with ``NoMotion`` where no mode is consistent, with ``TwoMotions`` where several modes are, and
with ``UnboundedReaction`` where a reaction grows beyond all bounds or the reactions are not determined.
"""

import math
from collections.abc import Sequence
from itertools import chain
from typing import Any

import sympy as sp

from asympk.automaton.automaton import Automaton
from asympk.mechanics.checks import require_continuous
from asympk.mechanics.elastic import accelerations, names_of_contact
from asympk.mechanics.kinetics import Kinetics
from asympk.mechanics.rigid import Motion
from asympk.scene import Scene
from asympk.symbolic.branches import mode_name
from asympk.symbolic.system import Friction, System


def rigid_system(contacts: Sequence[Kinetics]) -> System:
    """Return the ``System`` of a rigid mechanism from its equations for each of its contacts.

    Its flow keeps every constraint g'' = 0, so start at g = g' = 0 on each contact that is closed.
    """
    first, forces = contacts[0], [names_of_contact("NF", contacts, k) for k in range(len(contacts))]
    for kinetics in contacts:
        if not kinetics.unilateral:  # at a jump a unilateral contact opens or is hit, which its flow decides
            require_continuous(kinetics, (kinetics.gap, kinetics.gap_rate), "the constraint or its rate")
    gaps, _, rates = accelerations(contacts, range(len(first.velocities)), [*chain(*forces)], lambda expr: expr)
    frictions = [
        Friction(
            velocity=kinetics.slip, force=force, normal=normal, load=kinetics.load * normal, kinetic=kinetics.friction,
            static=kinetics.static, constraint=gap,
            **{"gap": kinetics.gap} if kinetics.unilateral else {"gap_rate": kinetics.gap_rate},
        )
        for kinetics, (normal, force), gap in zip(contacts, forces, gaps, strict=True)
    ]
    moved = dict(zip(first.coordinates, first.velocities, strict=True))
    timed = any(kinetics.timed for kinetics in contacts)
    return System.with_frictions(moved | rates, {}, frictions, time=first.time if timed else None)


def automaton_at(system: System, values: dict[sp.Symbol, Any], start: dict[str, Any]) -> tuple[Automaton, tuple]:
    """Return the automaton of the rigid ``system`` at numbers, and the state of ``start``."""
    scene = Scene(system=system, values={s: values[s] for s in system.parameters if s in values}, start=start, until=1)
    return Automaton.at(system, scene.values), scene.start


def motions_of_all(automaton: Automaton, t: Any, start: tuple) -> tuple[Motion, ...]:
    """Return the motions of a rigid system from ``start``, by the names of its modes, with all reactions.

    A reaction that is not determined is nan.
    """
    found, normals = automaton.motions(t, start), [friction.normal for friction in automaton.system.frictions]
    reactions = ([float(forces.get(normal, math.nan)) for normal in normals] for forces in found.values())
    return tuple(Motion(mode_name(branch), (*own,)) for branch, own in zip(found, reactions, strict=True))
