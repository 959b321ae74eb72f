"""Beyond the paper: the jump law with its logarithms, and the exact slow lines."""

# %% One integral for all modes
# The smooth mass obeys m x2'' = R cos(alpha) whatever friction does, so one combination of the states changes slowly
# in every mode. The package finds it, rather than being told.
import sympy as sp

from asympk.asymptotics.jump import first_integral, jump_map
from asympk.symbolic.manifold import slow_manifolds
from asympk.symbolic.regimes import regimes
from asympk.systems import painleve_klein as pk

system = pk.system()
integral = first_integral(system)

# %% The jump from z < 0 (steep rod)
# A layer lasts O(mu log(1/mu)); y reaches O(1/mu) in it, so x moves although the layer is short. As the integral
# changes by O(mu log(1/mu)) only and mu y returns to zero, z -> 0 must carry x -> x - z.
below = jump_map(system, order=1, start={pk.sigma: 1, pk.x: 0, pk.y: sp.Rational(1, 5), pk.z: -1})
landing, leaving = below.events

# %% The jump from beyond the divide (z > 0, s < -1/sigma)
above = jump_map(system, order=1, start={pk.sigma: 1, pk.x: 0, pk.y: -3, pk.z: 1})

# %% The slow lines in closed form
# y = lambda (x - 1/b) solves a linear mode exactly; its series has Catalan numbers and converges for |mu| < |b| / 4,
# which for b > 0 is exactly where node turns to focus.
planes = slow_manifolds(system, order=5)
lines = {plane.name: plane.closed for plane in planes}
level = {"Pi1": pk.sigma + 4, "Pi2": -pk.sigma}
catalan = {
    plane.name: tuple(sp.cancel(-plane.coefficient(k) * level[plane.name] ** k / (pk.x - 1 / level[plane.name]))
                      for k in range(6))
    for plane in planes
}

# %% Where the shallow rod meets z = 0
# Pi2 reaches z = 0 at s = -1/sigma: above the edge 1/(sigma + 3) of the stick region and so in it for sigma > -3/2,
# below this edge, outside the region, for sigma < -3/2.
meeting = {regime.condition: regime.passages[1].meets or "nothing" for regime in regimes(system)}

RESULTS = {
    "integral": integral.expr,
    "its_rate": integral.rate,
    "jump_from_below_itinerary": tuple(map(sp.Symbol, below.itinerary)),
    "jump_from_below_domain": below.domain,
    "landing_mu_y": landing.y.coefficient(-1),
    "landing_x": landing.x.coefficient(0),
    "jump_x": below.x.coefficient(0),
    "jump_x_mu_log": sp.factor(below.x.coefficient(1, 1)),
    "jump_x_mu": below.x.coefficient(1),
    "jump_z_mu_log": sp.factor(below.z.coefficient(1, 1)),
    "jump_z_mu": below.z.coefficient(1),
    "time_to_land_mu_log": landing.t.coefficient(1, 1),
    "time_to_leave_mu_log": leaving.t.coefficient(1, 1),
    "jump_from_above_itinerary": tuple(map(sp.Symbol, above.itinerary)),
    "jump_from_above_domain": above.domain,
    "jump_from_above_x": above.x.coefficient(0),
    "jump_from_above_x_mu_log": sp.factor(above.x.coefficient(1, 1)),
    "slow_lines": {sp.Symbol(name): line for name, line in lines.items()},
    "catalan_coefficients": {sp.Symbol(name): numbers for name, numbers in catalan.items()},
    "pi2_meets": meeting,
}
