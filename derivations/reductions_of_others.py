"""Reductions that others published, and their next terms: enzyme kinetics twice, a predator with two stages."""

# %% Michaelis and Menten, little enzyme (Heineken, Tsuchiya and Aris 1967)
# s' = -s + (s + kappa - lambda) c, mu c' = s - (s + kappa) c: the slow manifold is the quasi-steady state of c.
import sympy as sp

import asympk as ap

s, c, u, mu = *sp.symbols("s c u", positive=True), sp.Symbol("mu", positive=True)
kappa, lambda_ = sp.symbols("kappa lambda", positive=True)
enzyme = ap.System.smooth(slow={s: -s + (s + kappa - lambda_) * c}, fast={c: s - (s + kappa) * c}, small=mu)
quasi_steady = ap.slow_manifold(enzyme, branch={c: s / (s + kappa)}, order=1)
standard, correction = (sp.factor(ap.reduced_flow(quasi_steady)[s].coeff(mu, k)) for k in (0, 1))
base = ap.jump_map(enzyme, order=1)[s].coefficient(1)

# %% The same reaction with slow product formation (Goeke, Walcher and Zerz 2015)
# The rate k2 of the product is small: k2 -> mu k2. Substrate and complex are both fast; u = s + c is slow. The branch
# is a root of a quadratic equation, so it stays implicit, carried by its own value.
k1, k_1, k2, e0 = sp.symbols("k1 k_-1 k2 e0", positive=True)
binding = k1 * (e0 - c) * (u - c) - k_1 * c
slow_product = ap.slow_manifold(ap.System.smooth({u: -k2 * c}, {c: binding - mu * k2 * c}, mu), order=0)
flow = ap.reduced_flow(slow_product)
on_branch = {u: s + c, c: k1 * e0 * s / (k1 * s + k_1)}
product_rate = sp.factor((flow[u] - flow[c]).subs({u: on_branch[u]}).subs({c: on_branch[c]}))

# %% A predator that searches and rests (Kruff, Lax, Liebscher and Walcher 2019)
# Prey b, all predators p, those that rest r. What changes the numbers is slow: rho, alpha, eta and the surplus theta.
b, p, r = sp.symbols("b p r", positive=True)
rho, alpha, beta, delta, eta, theta = sp.symbols("rho alpha beta delta eta theta", positive=True)
stages = ap.System.smooth(
    slow={b: rho * b * (1 - b) - alpha * b * (p - r), p: theta * r - eta * (p - r)},
    fast={r: beta * b * (p - r) - delta * r},
    small=mu,
)
predator = ap.slow_manifold(stages, branch={r: beta * b * p / (beta * b + delta)}, order=1)
rosenzweig_macarthur = {x: rate.coeff(mu, 0) for x, rate in ap.reduced_flow(predator).items()}

RESULTS = {
    "standard_reduction": standard,
    "its_correction": correction,
    "base_point": base,
    "slow_product_reduction": product_rate,
    "prey": sp.expand(sp.apart(rosenzweig_macarthur[b], p)),
    "predators": sp.factor(rosenzweig_macarthur[p]),
    "resting_correction": sp.factor(predator.coefficient(1)),
}
