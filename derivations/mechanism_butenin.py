"""Pfeiffer and Butenin: the rod without damping, a centre on one side of the paradox and a saddle on the other."""

# %% The elastic rod without damping
# With the compliance eps^2 the reaction x and y = eps x' are both fast.
import sympy as sp

from asympk.systems import butenin

system = butenin.system()
x, y = system.fast

# %% The phase plane (R, R')
# In slip the fast field is linear, x' = y, y' = -p x + a: energy y^2 / 2 + p x^2 / 2 - a x is kept in each mode.
energies = {}
for name in ("slip_same", "slip_opposite"):
    rate = sp.expand(system.mode(name).fast[y])
    energies[sp.Symbol(name)] = sp.factor(y**2 / 2 - sp.integrate(rate, x))

# %% Centre or saddle
# The eigenvalues are +-sqrt(-p): imaginary without a paradox, so the manifold is not normally hyperbolic.
squares = {sp.Symbol(name): sp.factor(system.mode(name).fast[y].diff(x)) for name in ("slip_same", "slip_opposite")}

RESULTS = {"kept_in_slip": energies, "squares_of_the_eigenvalues": squares}
