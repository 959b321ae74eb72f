r"""Where the rigid contact has a paradox: friction load |G_NT| > G_NN, the critical friction and its least value."""

import sympy as sp

from asympk.mechanics.tidy import shortest, tidy


def critical_friction(kinetics):
    """Return G_NN / (load |G_NT|), oo where G_NT vanishes identically."""
    normal, mixed = _ratio(kinetics)
    return sp.oo if mixed == 0 else normal / (kinetics.load * mixed)


def condition(kinetics):
    """Return friction load |G_NT| > G_NN, the condition for a paradox, without common factors."""
    normal, mixed = _ratio(kinetics)
    return sp.Gt(kinetics.friction * kinetics.load * mixed, normal)


def _ratio(kinetics):
    """Return G_NN and |G_NT| divided by what they have in common."""
    normal, mixed = kinetics.delassus[0, 0], kinetics.delassus[0, 1]
    if mixed == 0:
        return sp.S.One, sp.S.Zero
    ratio = shortest(tidy(normal / mixed), tidy(-normal / mixed))
    return tuple(map(sp.Abs, sp.fraction(ratio)))
