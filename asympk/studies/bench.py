"""What a trajectory costs: times as ratios, measured in one run with medians.

A line of the table is a label and a function without arguments that returns its text; add yours to ``LINES``.
"""

import random
import subprocess
import sys
from statistics import median
from time import perf_counter

import asympk as ap

SCENES = {"i": (0, 0, 1), "ii": (0, 0.2, -1), "iii": (-1, -1, 1)}
MUS = (1e-2, 1e-4, 1e-6)
STARTS = 1_000_000
BOXES = {
    "random starts": ((-2, 2), (-2, 2), (-2, 2)),
    "one itinerary": ((0, 0), (0.1, 0.3), (-1.5, -0.5)),  # slip_opposite, stick, slip_same
}


def seconds(call, least=5, budget=0.25):
    """Return the median time of a call, of at least ``least`` calls and as many as fit the budget."""
    times, end = [], perf_counter() + budget
    while len(times) < least or perf_counter() < end:
        begin = perf_counter()
        call()
        times.append(perf_counter() - begin)
    return median(times)


def scalar(name, mu):
    """Compare the exact flow in doubles and in 50 digits with a careful LSODA at 1e-6."""
    scene = ap.Scene(1, mu, SCENES[name], 5)
    ap.solve(scene)
    exact = seconds(lambda: ap.solve(scene))
    digits = seconds(lambda: ap.solve(scene, digits=50))
    lsoda = seconds(lambda: ap.solve(scene, method="lsoda", rtol=1e-6, atol=1e-6))
    true = ap.solve(scene, digits=50).final
    error = max(abs(p - q) for p, q in zip(ap.solve(scene).final, true, strict=True))
    return (f"{exact * 1e6:7.1f} us, error {float(error):.0e}; 50 digits {digits / exact:5.0f} times, "
            f"LSODA {lsoda / exact:6.0f} times")


def random_starts(mu):
    """Time the scalar flow on starts that differ, so that no branch is foreseen."""
    draw = random.Random(1)
    scenes = [ap.Scene(1, mu, [draw.uniform(-2, 2) for _ in range(3)], 5) for _ in range(300)]
    each = seconds(lambda: [ap.solve(scene) for scene in scenes]) / len(scenes)
    return f"{each * 1e6:7.1f} us per trajectory"


def many(box, mu):
    """Time the array flow on starts in a box against the scalar flow."""
    import numpy as np

    random = np.random.default_rng(1)
    x, y, z = (random.uniform(*side, STARTS) for side in BOXES[box])
    each = seconds(lambda: ap.solve_many(1, mu, x, y, z, 5)) / STARTS
    scenes = [ap.Scene(1, mu, start, 5) for start in zip(x[:200], y[:200], z[:200], strict=True)]
    alone = seconds(lambda: [ap.solve(scene) for scene in scenes]) / len(scenes)
    return f"{each * 1e9:7.1f} ns per trajectory, the scalar flow {alone / each:.0f} times"


def imports():
    """Time a bare interpreter, and one that imports asympk and solves a first scene."""
    first = "import asympk; asympk.solve(asympk.Scene(sigma=1, mu=1e-3, start=(0, 0.2, -1), until=5))"
    bare, full = (seconds(lambda code=code: subprocess.run([sys.executable, "-c", code], check=True))
                  for code in ("pass", first))  # fmt: skip
    return f"{(full - bare) * 1e3:7.1f} ms over a bare interpreter"


LINES = [
    *(
        (f"solve, scene ({name}), mu = {mu:g}", lambda name=name, mu=mu: scalar(name, mu))
        for name in SCENES for mu in MUS
    ),
    *((f"solve, random starts, mu = {mu:g}", lambda mu=mu: random_starts(mu)) for mu in MUS),
    *(
        (f"solve_many, {box}, mu = {mu:g}", lambda box=box, mu=mu: many(box, mu))
        for box in BOXES for mu in (1e-3, 1e-6)
    ),
    ("import and a first solve", imports),
]


def main(lines=None):
    """Print the table, line by line as it is measured; return 0."""
    for label, line in lines or LINES:
        print(f"{label:36s} {line()}", flush=True)
    return 0
