"""The Painlevé-Klein example: stub replaced by the derivation from the elastic rod."""

import sympy as sp

from asympk.system import System

x, y, z = sp.symbols("x y z", real=True)
mu = sp.Symbol("mu", positive=True)
sigma, sigma0 = sp.symbols("sigma sigma0", real=True)


def system():
    """Return (2.7)-(2.9) for general sigma."""
    force = sp.Symbol("F", real=True)
    s = x + y
    return System.with_friction(
        slow={x: y}, fast={y: 1 - 2 * s + force}, velocity={z: 1 - s + force}, force=force, load=s,
        kinetic=sigma + 2, static=sigma0 + 2, small=mu, assumptions=sp.And(sigma > -2, sigma0 >= sigma),
    )
