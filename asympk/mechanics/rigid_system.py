r"""The rigid mechanism as a system that runs: states are all coordinates and all velocities.

    q' = u,    u' = M^-1 (Q + W_N N + W_T F),    0 = g'' = a_N + G_NN N + G_NT F  while the contact is closed

N is the reaction that the constraint determines, mode by mode, F the friction force with the load nu |N|. Where no
mode is consistent, or several are, the flow stops with ``NoMotion`` or ``TwoMotions``; where the reaction grows beyond
all bounds, with ``UnboundedReaction``.
"""

from asympk.mechanics.checks import require_continuous
from asympk.mechanics.elastic import force_names, with_time
from asympk.mechanics.kinetics import Kinetics
from asympk.symbolic.system import Friction, System


def rigid_system(kinetics: Kinetics) -> System:
    """Return the ``System`` of the rigid mechanism; its flow keeps the constraint g'' = 0, so start at g = g' = 0."""
    if not kinetics.unilateral:  # one that opens flies off, or is hit
        require_continuous(kinetics, (kinetics.gap, kinetics.gap_rate), "the constraint or its rate")
    normal, force = force_names(kinetics)
    rates = dict(zip(kinetics.coordinates, kinetics.velocities, strict=True))
    for row, u in enumerate(kinetics.velocities):
        by_normal, by_friction, free = kinetics.response[row, :]
        rates[u] = free + by_normal * normal + by_friction * force
    G = kinetics.delassus
    friction = Friction(
        velocity=kinetics.slip, force=force, normal=normal, load=kinetics.load * normal, kinetic=kinetics.friction,
        static=kinetics.static, constraint=kinetics.free[0] + G[0, 0] * normal + G[0, 1] * force,
        gap=kinetics.gap if kinetics.unilateral else None,
    )  # fmt: skip
    return with_time(System.with_frictions(rates, {}, (friction,)), kinetics.time)
