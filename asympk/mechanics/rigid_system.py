r"""The rigid mechanism as a system that runs: states are all coordinates and all velocities.

    q' = u,    u' = M^-1 (Q + W_N N + W_T F),    0 = g'' = a_N + G_NN N + G_NT F  while the contact is closed

N is the reaction, which the constraint determines in each mode, and F the friction force with the load nu |N|. A flow
stops with ``NoMotion`` where no mode is consistent, with ``TwoMotions`` where several modes are, and with
``UnboundedReaction`` where the reaction grows beyond all bounds.
"""

from asympk.mechanics.checks import require_continuous
from asympk.mechanics.elastic import force_names
from asympk.mechanics.kinetics import Kinetics
from asympk.symbolic.system import Friction, System


def rigid_system(kinetics: Kinetics) -> System:
    """Return the ``System`` of the rigid mechanism; its flow keeps the constraint g'' = 0, so start at g = g' = 0."""
    if not kinetics.unilateral:  # at a jump a unilateral contact opens or is hit, which its flow decides
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
        **{"gap": kinetics.gap} if kinetics.unilateral else {"gap_rate": kinetics.gap_rate},
    )  # fmt: skip
    return System.with_frictions(rates, {}, (friction,), time=kinetics.time if kinetics.timed else None)
