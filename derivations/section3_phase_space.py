"""Section 3 of Fufaev (1991): slow planes, stick regions and regimes, for every sigma > -2."""

# %% The slow planes
# mu y' = 0 in each slip mode is a plane x + y = const; dg/dy tells whether it attracts, and the signs of z and of the
# load on which side of z = 0 it lives.
import sympy as sp

from asympk.symbolic.manifold import integral_curves, rest_state, slow_manifolds
from asympk.symbolic.regimes import regimes, thresholds
from asympk.symbolic.stability import eigenvalues, series_in_mu
from asympk.symbolic.stick import stick_regions
from asympk.systems import painleve_klein as pk

system = pk.system()
planes = slow_manifolds(system, order=2)
levels = {plane.name: sp.cancel(pk.x + plane.coefficient(0)) for plane in planes}

# %% Motion on them
# x' on a plane depends on x alone; dz/dx integrates to the curves of the paper's fig. 6, and the rest state of x is
# the half-line that motions on Pi1 approach.
curves = {plane.name: integral_curves(plane)[pk.z].coeff(pk.mu, 0) for plane in planes}
rests = {plane.name: rest_state(plane) for plane in planes}

# %% Eigenvalues
# mu lambda^2 + b lambda + b = 0 in every mode: the slow root near -1, the fast one near -b / mu, meeting at mu = b/4.
spectra = eigenvalues(system)

# %% The plane z = 0
# The friction cone |1 - s| <= (sigma0 + 2) |s|, solved for s: where motions stick, and where they cross.
regions = stick_regions(system)

# %% Regimes
# The picture changes with sigma where G2 goes to infinity (-1), where Pi2 meets z = 0 on an edge of G1 (-3/2), and
# where Pi2 passes through infinity from z < 0 to z > 0 (0): the paradox begins there.
changes = thresholds(system)
second_plane = {regime.condition: sp.Integer(regime.passages[1].side) for regime in regimes(system)}

RESULTS = {
    "levels_of_the_slow_planes": {sp.Symbol(name): level for name, level in levels.items()},
    "slow_planes_to_order_2": {sp.Symbol(plane.name): plane.expr for plane in planes},
    "half_spaces": {sp.Symbol(plane.name): plane.domain for plane in planes},
    "stability": {sp.Symbol(plane.name): plane.stability for plane in planes},
    "integral_curves": {sp.Symbol(name): curve for name, curve in curves.items()},
    "rest_states": {sp.Symbol(name): rest.state for name, rest in rests.items()},
    "slow_eigenvalues": {sp.Symbol(s.mode): s.slow for s in spectra},
    "fast_eigenvalues": {sp.Symbol(s.mode): s.fast for s in spectra},
    "slow_series": {sp.Symbol(s.mode): series_in_mu("slow", s, 3) for s in spectra},
    "node_to_focus_at_mu": {sp.Symbol(s.mode): s.coalescence for s in spectra},
    "edges_of_stick": regions.edges,
    "stick_region": {cell.condition: sp.Union(*(span.as_set() for span in cell.spans)) for cell in regions.stick.cells},
    "thresholds_of_sigma": changes,
    "sign_of_z_on_pi2": second_plane,
}
