"""Starts that touch: tangent to a surface, on two surfaces at once, on a slow line, where the roots coalesce.

Each family draws scenes of which a sign hangs on the last bits of doubles. ``python tests/tangent.py 10000`` compares
``solve``, also of ``Scene.near``, and ``solve_many`` with forty digits on that many.
"""

import math
import sys
from collections import Counter
from random import Random

import mpmath

import asympk as ap

MUS = (1e-3, 0.1, 0.05, 1e-2, 1e-6, 1 / 3, 0.25, 2.0**-10, 0.7)
SIGMAS = (1.0, 0.5, 2.3, 0.1, -0.5, -1.0, -1.25, -1.9, 0.0, 7.0)


def draws(count, seed=7):
    """Yield (family, numbers): (sigma, sigma0, mu, x, y, z, until), or with (x, offset, z, until, manifold)."""
    rng = Random(seed)
    for n in range(count):
        family = FAMILIES[n % len(FAMILIES)]
        yield family.__name__, family(rng)


def on_s_zero_without_rate(rng):
    """s = 0 and 1 + mu y = 0 but for rounding."""
    sigma, sigma0, mu = _parameters(rng)
    mu = rng.choice((mu, rng.randrange(1, 1000) / 1000))
    y = _nudged(rng, -1 / mu)
    return sigma, sigma0, mu, -y, y, _side(rng), _time(rng, mu)


def on_an_edge(rng):
    """z = 0 and s on an edge of the static cone, at any rate, or at none."""
    sigma, sigma0, mu = _parameters(rng)
    edge = _edge(rng, sigma0)
    y = rng.choice((rng.uniform(-3, 3), _nudged(rng, edge / mu), rng.uniform(-1, 1) / mu, edge))
    return sigma, sigma0, mu, _nudged(rng, edge - y), y, rng.choice((0.0, 0.0, 0.0, _tiny(rng))), _time(rng, mu)


def beside_an_edge(rng):
    """The same by offsets of any size in x, y and z."""
    sigma, sigma0, mu = _parameters(rng)
    edge = _edge(rng, sigma0)
    return sigma, sigma0, mu, edge, _tiny(rng), rng.choice((0.0, _tiny(rng))), _time(rng, mu)


def on_a_slow_line(rng):
    """The state on the slow line of a mode, as well as doubles hold it."""
    sigma, sigma0, mu = _parameters(rng)
    b = rng.choice((-sigma, sigma + 4))
    if b == 0 or 0 < b < 4 * mu:
        return on_a_slow_line(rng)
    x = rng.choice((rng.uniform(-3, 3), 1 / b, 0.0))
    rate = -2 / (1 + mpmath.sqrt(1 - 4 * mpmath.mpf(mu) / b))
    y = _nudged(rng, float(rate * (x - 1 / mpmath.mpf(b))))
    return sigma, sigma0, mu, x, y, _side(rng), _time(rng, mu)


def beside_a_slow_line(rng):
    """A ``Scene.near`` of Pi1 or Pi2 with s or z at its smallest, coalescence near, or its horizon at an event."""
    sigma, sigma0, mu = _parameters(rng)
    manifold, side = rng.choice((("Pi1", 1), ("Pi2", -1)))
    b = sigma + 4 if side > 0 else -sigma
    mu = _nudged(rng, b / 4) if b > 0 and rng.random() < 0.2 else mu
    if b == 0 or 0 < b <= 4 * mu:
        return beside_a_slow_line(rng)
    rho = (1 + math.sqrt(1 - 4 * mu / b)) / 2
    x = rng.choice((rng.uniform(-3, 3), 1 / b, _nudged(rng, rho / mu), 0.0))
    s = 1 / (b * rho) - mu / (b * rho**2) * x
    offset = rng.choice((0.0, _tiny(rng), _nudged(rng, -s), rng.uniform(-1, 1)))
    z = rng.choice((1.0, 0.1, abs(_tiny(rng)))) * side * math.copysign(1, -2 * (x - 1 / b) / (2 * rho) + offset + x)
    numbers = sigma, sigma0, mu, x, offset, z
    try:
        events = ap.solve(scene_of((*numbers, 2.0, manifold))).events
    except ap.errors.InputError:  # rounding has the start on the other side of s = 0
        return beside_a_slow_line(rng)
    until = _nudged(rng, events[-1].t) if events and rng.random() < 0.3 else _time(rng, mu)
    return *numbers, until, manifold


def at_coalescence(rng):
    """Two equal roots in a mode: 4 mu = sigma + 4, -sigma or 1."""
    sigma, _, mu = _parameters(rng)
    which = rng.randrange(3)
    mu = 0.25 if which == 2 else min(mu, 0.4)
    sigma = _nudged(rng, (4 * mu - 4, -4 * mu, sigma)[which])
    mu = _nudged(rng, (sigma + 4) / 4) if which == 0 and sigma > -2 else mu
    if sigma <= -2:
        sigma, mu = -1.5, 0.625
    sigma0 = rng.choice((sigma, sigma + 0.5))
    state = rng.choice(((rng.uniform(-2, 2), rng.uniform(-2, 2), _side(rng)), (0.0, 0.0, _side(rng)),
                        (1 / mu, -1 / mu, 1.0), (_edge(rng, sigma0), 0.0, 0.0)))
    return sigma, sigma0, mu, *state, rng.uniform(0.1, 4)


def touching_s_zero(rng):
    """A run that is to touch s = 0: back from s = s' = 0."""
    return _back(rng, lambda mu, sigma0: (1 / mu, -1 / mu, rng.uniform(-2, 2)))


def touching_z_zero(rng):
    """A run that is to touch z = 0: back from z = z' = 0."""

    def target(mu, sigma0):
        edge = _edge(rng, sigma0)
        y = rng.uniform(-3, 3)
        return edge - y, y, mpmath.mpf(0)

    return _back(rng, target)


def touching_an_edge(rng):
    """A run that is to touch an edge of the cone in stick: back from s' = 0 there."""

    def target(mu, sigma0):
        edge = _edge(rng, sigma0)
        return edge - edge / mu, edge / mu, mpmath.mpf(0)

    return _back(rng, target, stick=rng.random() < 0.7)


def meeting_the_corner(rng):
    """A run that is to meet s = 0 and z = 0 at once."""

    def target(mu, sigma0):
        y = rng.choice((rng.uniform(-3, 3), float(-1 / mu)))
        return -y, y, mpmath.mpf(0)

    return _back(rng, target)


def on_all_planes(rng):
    """Several quantities zero, or the smallest and largest of doubles."""
    sigma, sigma0, mu = _parameters(rng)
    few = (0.0, 0.0, 1.0, -1.0, 1 / mu, -1 / mu, 5e-324, -1e-300, _tiny(rng))
    return sigma, sigma0, mu, rng.choice(few), rng.choice(few), rng.choice(few), _time(rng, mu)


def ending_at_an_event(rng):
    """A horizon that is to be the time of an event."""
    sigma, sigma0, mu, *start, until = on_s_zero_without_rate(rng) if rng.random() < 0.3 else _ordinary(rng)
    events = ap.solve(ap.Scene(sigma, mu, start, until, sigma0)).events
    return sigma, sigma0, mu, *start, _nudged(rng, events[-1].t) if events else until


def between_two_stories(rng):
    """A start, or a horizon, at which one list of events gives way to another: found by halving."""
    while True:
        one = _ordinary(rng)
        which = rng.randrange(3, 7)
        other = (*one[:which], rng.uniform(0.1, 3) if which == 6 else rng.uniform(-2, 2), *one[which + 1:])
        here, there = _story(one), _story(other)
        if here != there:
            break
    low, high = one[which], other[which]
    while low < (middle := (low + high) / 2) < high or high < middle < low:
        same = _story((*one[:which], middle, *one[which + 1:])) == here
        low, high = (middle, high) if same else (low, middle)
    return *one[:which], _nudged(rng, low), *one[which + 1:]


def _story(numbers):
    sigma, sigma0, mu, *start, until = numbers
    return [e.kind for e in ap.solve(ap.Scene(sigma, mu, start, until, sigma0)).events]


FAMILIES = (between_two_stories, on_s_zero_without_rate, on_an_edge, beside_an_edge, on_a_slow_line,
            beside_a_slow_line, at_coalescence, touching_s_zero, touching_z_zero, touching_an_edge,
            meeting_the_corner, on_all_planes, ending_at_an_event)


def _parameters(rng):
    sigma = rng.choice((rng.choice(SIGMAS), rng.uniform(-1.95, 4)))
    mu = rng.choice((rng.choice(MUS), 10 ** rng.uniform(-6, 0)))
    return sigma, rng.choice((sigma, sigma, sigma + 0.25, sigma + rng.random())), mu


def _ordinary(rng):
    return *_parameters(rng), *(rng.uniform(-2, 2) for _ in range(3)), rng.uniform(0.1, 3)


def _time(rng, mu):
    return rng.choice((2.0, rng.uniform(0, 5), mu * rng.uniform(0, 8)))


def _edge(rng, sigma0):
    return 1 / (sigma0 + 3) if sigma0 == -1 or rng.random() < 0.5 else -1 / (sigma0 + 1)


def _side(rng):
    return rng.choice((1.0, -1.0, 0.0, 0.1, -0.1, _tiny(rng)))


def _tiny(rng):
    return rng.choice((1, -1)) * 10.0 ** rng.choice((rng.uniform(-20, 0), -rng.randrange(0, 300)))


def _nudged(rng, value):
    """Return the double nearest to a number, or one a few away."""
    value = float(value)
    return value + math.ulp(value) * rng.choice((0, 0, 0, 1, -1, 3, -20, 400))


def _back(rng, target, stick=False):
    """Return a scene whose slip, or stick, comes to ``target(mu, sigma0)`` if rounding lets it."""
    sigma, sigma0, mu = _parameters(rng)
    with mpmath.workdps(60):
        exact = mpmath.mpf(mu)
        a, b = (0, mpmath.mpf(1)) if stick else (1, mpmath.mpf(rng.choice((sigma + 4, -sigma))))
        x, y, z = map(mpmath.mpf, target(exact, mpmath.mpf(sigma0)))
        t = float(min(1, mu / abs(b) if b else 1)) * rng.uniform(0.05, 6)
        rates = mpmath.matrix([[0, 1, 0, 0], [-b / exact, -b / exact, 0, a / exact],
                               [0] * 4 if stick else [1 - b, 1 - b, 0, a], [0] * 4])
        start = mpmath.expm(-t * rates) * mpmath.matrix([x, y, 0 if stick else z, 1])
    return sigma, sigma0, mu, *map(float, start[:3]), rng.choice((t, 2 * t, t + 1))


def scene_of(numbers):
    """Return the ``Scene`` of what a family draws."""
    sigma, sigma0, mu, x, y, z, until, *manifold = numbers
    if manifold:
        return ap.Scene.near(*manifold, x=x, offset=y, z=z, sigma=sigma, mu=mu, until=until, sigma0=sigma0)
    return ap.Scene(sigma, mu, (x, y, z), until, sigma0)


def differences(numbers):
    """Return what ``solve`` and ``solve_many`` tell of a scene that forty digits do not."""
    scene = scene_of(numbers)
    path, true = ap.solve(scene), ap.solve(scene, digits=40)
    kinds, size = [e.kind for e in true.events], _size(true)
    found = []
    if [e.kind for e in path.events] != kinds:
        found.append("solve: other events")
    elif _gap(path.final, true) > path.error * size:
        found.append("solve: a larger error than it says")
    if scene.near_to:
        return found
    many = ap.solve_many(scene.sigma, scene.mu, *scene.start, scene.until, scene.sigma0, events=True)
    if list(many.events().kind) != kinds:
        found.append("solve_many: other events")
    elif _gap(many.final.tolist(), true) > 3e-15 * size:
        found.append("solve_many: a large error")
    return found


def _gap(final, true):
    return max(abs(found - exact) for found, exact in zip(final[::2], true.final[::2], strict=True))


def _size(path):
    x, _, z = path.scene.start
    states = ((x, z), *((e.x, e.z) for e in path.events), path.final[::2])
    return max(1, *(abs(v) for state in states for v in state))


def main(count, seed=7):
    """Compare on ``count`` scenes, print those that differ and how many they are, by family."""
    tally = Counter()
    for n, (family, numbers) in enumerate(draws(count, seed)):
        if n % 1000 == 0:
            print(f"{n} compared", file=sys.stderr, flush=True)
        try:
            found = differences(numbers) or ["the same"]
        except ArithmeticError as reason:
            found = [type(reason).__name__]
        tally.update((family, what) for what in found)
        if found != ["the same"]:
            print(family, numbers, *found, flush=True)
    for (family, what), times in sorted(tally.items()):
        print(f"{times:6} {family}: {what}")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
