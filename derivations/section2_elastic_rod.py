"""Section 2 of Fufaev (1991): the elastic rod with damping, its scales, and the equations (2.7)-(2.12)."""

# %% The rod shortens and turns
# When M1 gains delta on M2 the rod shortens by Delta l and turns by beta; the first terms in delta are (2.2).
import sympy as sp

from asympk.systems import painleve_klein as pk
from asympk.systems.painleve_klein import rod

compression, turn = rod.small_angle()

# %% The rod's law
# A spring k Delta l / l beside a damper h k (Delta l)' gives (2.3); R1 is the elastic part.
law = rod.kelvin_voigt()

# %% The equations of motion
# Newton's law at the angle alpha + beta, subtracted mass from mass, with delta in terms of R1: (2.4). What is dropped
# is small like 1/k, as is mu: the small angle costs as much as the first correction in mu.
elastic = rod.elastic_rod()

# %% Slip and stick
# Coulomb's friction on M1 for u > 0 gives (2.5), for u < 0 the same with -f; u = u' = 0 with F eliminated, (2.6).
forward, backward, stick = elastic.slip(1), elastic.slip(-1), elastic.stick()

# %% The scales
# The load R cos(alpha) / P should begin rho + rho' and v' with 1: three equations for the scales of time, reaction and
# velocity. What then multiplies rho'' is mu; the coefficient of the load in (2.8) is sigma.
groups = pk.groups()
units = {group.symbol: rod.dimension(group.definition.subs({sp.Symbol("t", real=True): rod.h * rod.l,
         sp.Symbol("x_1", real=True): rod.l})) for group in groups}

# %% The nondimensional system
# One field with the friction force in it, and three modes from the friction law: (2.7), (2.8), (2.9).
system = pk.system()
s = sp.Symbol("s", real=True)


def in_terms_of_load(expr):
    """Write a right-hand side in terms of s = x + y."""
    return sp.collect(sp.expand(expr.subs(pk.y, s - pk.x)), s)


modes = {mode.name: (in_terms_of_load(mode.fast[pk.y]), in_terms_of_load(mode.slow[pk.z])) for mode in system.modes}
at_one = {name: tuple(expr.subs(pk.sigma, 1) for expr in pair) for name, pair in modes.items()}

# %% The smooth mass
# m x2'' = R cos(alpha) survives every mode: z' - mu y' - x' = x whatever friction does.
invariant = {sp.expand(mode.slow[pk.z] - mode.fast[pk.y] - mode.slow[pk.x]) for mode in system.modes}

RESULTS = {
    "equation_2_2_compression": compression,
    "equation_2_2_turn": turn,
    "equation_2_3": sp.Eq(rod.R, law),
    "equation_2_4_balance": sp.Eq(elastic.balance, 0),
    "equation_2_4_acceleration": sp.Eq(sp.Symbol("udot"), elastic.acceleration),
    "dropped_beside_1": elastic.dropped,
    "dropped_in_friction": elastic.dropped_friction,
    "equation_2_5_forward": sp.Eq(forward[0], 0),
    "equation_2_5_backward": sp.Eq(backward[0], 0),
    "equation_2_6": sp.Eq(stick, 0),
    "groups": {group.symbol: group.definition for group in groups},
    "units_of_the_groups": units,
    "modes_mu_dy_and_dz": {sp.Symbol(name): pair for name, pair in modes.items()},
    "modes_at_sigma_1": {sp.Symbol(name): pair for name, pair in at_one.items()},
    "rate_of_z_minus_mu_y_minus_x": tuple(invariant),
}
