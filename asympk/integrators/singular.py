r"""The approach to a point where the reaction of a rigid contact ceases to be determined: p -> 0 in R = -a / p.

In the time s with dt = p ds the field is smooth and the point an equilibrium, into which p decays like an exponential
and the states like powers of p. So the states at three levels of p in a geometric sequence give their limit.
"""

LEVELS = (1e-5, 1e-7, 1e-9)  # of p, relative to its value at the start


def approach(mode, guard, t, state):
    """Return (t, state) where the guard p of ``mode`` vanishes, from a state before it; None where p does not decay."""
    import numpy as np
    from scipy.integrate import solve_ivp

    first = mode.guard_values(t, state)[guard]

    def field(_, w):
        at = [*map(float, w)]
        p = mode.guards(*at, *mode.p)[guard]
        return [p, *(p * rate for rate in mode.field(*at, *mode.p))]

    def level(part):
        def reached(_, w):
            return mode.guards(*map(float, w), *mode.p)[guard] / first - part

        reached.terminal = part == LEVELS[-1]
        return reached

    with np.errstate(all="ignore"):
        found = solve_ivp(field, (0, 1e6 / abs(first)), [t, *state], method="LSODA", rtol=1e-12, atol=1e-14,
                          events=[level(part) for part in LEVELS])  # fmt: skip
    if not all(len(states) for states in found.y_events):
        return None
    limit = _limit(*(states[-1] for states in found.y_events))
    return limit[0], tuple(limit[1:])


def _limit(first, second, third):
    """Return the limit of three states whose distance from it is nearly geometric, each by itself."""
    found = []
    for a, b, c in zip(*(map(float, w) for w in (first, second, third)), strict=True):
        bend = (c - b) - (b - a)
        found.append(c - (c - b) ** 2 / bend if abs(c - b) < abs(b - a) and bend else c)
    return found
