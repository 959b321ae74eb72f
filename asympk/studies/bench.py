"""The cost of a trajectory: medians of times measured in one run, and their ratios.

A line of the table is a label and a function without arguments that returns its text; add yours to ``LINES``.
"""

import random
import subprocess
import sys
from collections.abc import Callable, Iterable
from functools import cache, partial
from itertools import product
from math import inf
from statistics import median
from time import perf_counter
from typing import Any

import numpy as np
import sympy as sp

import asympk as ap
from asympk.storage.rows import StoredRows

SCENES = {"i": (0, 0, 1), "ii": (0, 0.2, -1), "iii": (-1, -1, 1)}
MUS = (1e-2, 1e-4, 1e-6)
STARTS = 1_000_000
BOXES = {
    "random starts": ((-2, 2), (-2, 2), (-2, 2)),
    "one itinerary": ((0, 0), (0.1, 0.3), (-1.5, -0.5)),  # slip_opposite, stick, slip_same
}


def median_seconds(call: Callable[[], Any], least: int = 5, budget: float = 0.25, most: float = inf) -> float:
    """Return the median time of a call over ``least`` calls, or up to ``most`` if ``budget`` seconds allow."""
    times: list[float] = []
    end = perf_counter() + budget
    while len(times) < least or (len(times) < most and perf_counter() < end):
        begin = perf_counter()
        call()
        times.append(perf_counter() - begin)
    return median(times)


def scalar(name: str, mu: float) -> str:
    """Compare the exact flow in doubles with 50 digits and with LSODA at the tolerance 1e-6."""
    scene = ap.Scene(1, mu, SCENES[name], 5)
    ap.solve(scene)
    exact = median_seconds(lambda: ap.solve(scene))
    digits = median_seconds(lambda: ap.solve(scene, digits=50))
    lsoda = median_seconds(lambda: ap.solve(scene, method="lsoda", rtol=1e-6, atol=1e-6))
    true = ap.solve(scene, digits=50).final
    error = max(abs(p - q) for p, q in zip(ap.solve(scene).final, true, strict=True))
    return (f"{exact * 1e6:7.1f} us, error {float(error):.0e}; 50 digits {digits / exact:5.0f} times, "
            f"LSODA {lsoda / exact:6.0f} times")


def random_starts(mu: float) -> str:
    """Time the scalar flow on random starts, so that the processor cannot predict branches."""
    draw = random.Random(1)
    scenes = [ap.Scene(1, mu, [draw.uniform(-2, 2) for _ in range(3)], 5) for _ in range(300)]
    each = median_seconds(lambda: [ap.solve(scene) for scene in scenes]) / len(scenes)
    return f"{each * 1e6:7.1f} us per trajectory"


def many(box: str, mu: float) -> str:
    """Time the array flow on starts in a box against the scalar flow."""
    random = np.random.default_rng(1)
    x, y, z = (random.uniform(low, high, STARTS) for low, high in BOXES[box])
    each = median_seconds(lambda: ap.solve_many(1, mu, x, y, z, 5)) / STARTS
    scenes = [ap.Scene(1, mu, start, 5) for start in zip(x[:200], y[:200], z[:200], strict=True)]
    alone = median_seconds(lambda: [ap.solve(scene) for scene in scenes]) / len(scenes)
    return f"{each * 1e9:7.1f} ns per trajectory, the scalar flow {alone / each:.0f} times"


@cache
def rod_in_general_clothes() -> ap.System:
    """Return the system of the rod under other names, under which its kernel does not apply."""
    p, q, w, force = sp.symbols("p q w force", real=True)
    eps, k, k0 = sp.symbols("eps k k0")
    return ap.System.with_friction(slow={p: q}, fast={q: 1 - 2 * (p + q) + force}, velocity={w: 1 - (p + q) + force},
                                   force=force, load=p + q, kinetic=k + 2, static=k0 + 2, small=eps)


def beside_the_kernel(name: str, mu: float) -> tuple[ap.Scene, float, float, float]:
    """Return a scene of the rod in general clothes, and the seconds of the affine flow, of the kernel and of LSODA."""
    start = dict(zip("pqw", SCENES[name], strict=True))
    scene = ap.Scene(system=rod_in_general_clothes(), values={"eps": mu, "k": 1, "k0": 1}, start=start, until=5)
    for _ in range(6):  # the affine flow tables its decisions only after several runs
        ap.solve(scene)
    affine = median_seconds(lambda: ap.solve(scene))
    kernel = median_seconds(lambda: ap.solve(ap.Scene(1, mu, SCENES[name], 5)))
    return scene, affine, kernel, median_seconds(lambda: ap.solve(scene, method="lsoda", rtol=1e-6, atol=1e-6))


def general(name: str, mu: float) -> str:
    """Compare the affine flow with the rod's kernel, with LSODA on the same system, and with its own arrays."""
    scene, affine, kernel, lsoda = beside_the_kernel(name, mu)
    values = dict(zip(scene.system.parameters, scene.values, strict=True))
    spread = np.random.default_rng(1).uniform(-0.1, 0.1, (3, 20_000))
    starts = {s: at + off for s, at, off in zip(scene.system.states, scene.start, spread, strict=True)}
    begin = perf_counter()
    ap.solve_many(system=rod_in_general_clothes(), values=values, start=starts, until=5)
    each = (perf_counter() - begin) / spread.shape[1]
    return (f"{affine * 1e6:7.1f} us, the kernel's {affine / kernel:.0f} times; LSODA {lsoda / affine:.1f} times; "
            f"{affine / each:.1f} times the arrays' {each * 1e6:.0f} us")


def peer_rows() -> StoredRows:
    """Return the rows on the kernel of the rod against its nearest peer, the affine flow, for all scenes and mu.

    ``affine`` is the time of the affine flow over that of the kernel, ``lsoda`` that of LSODA at 1e-6 over that of the
    affine flow.
    """
    found = StoredRows(provenance={"until": 5, "sigma": 1})
    for name, mu in product(SCENES, MUS):
        _, affine, kernel, lsoda = beside_the_kernel(name, mu)
        times = {"affine": affine / kernel, "lsoda": lsoda / affine}
        found.append({"scene": name, "mu": mu, **{of: float(f"{ratio:.3g}") for of, ratio in times.items()}})
    return found


def imports() -> str:
    """Time a bare interpreter, and one that imports asympk and solves a first scene."""
    first = "import asympk; asympk.solve(asympk.Scene(sigma=1, mu=1e-3, start=(0, 0.2, -1), until=5))"
    runs = (partial(subprocess.run, [sys.executable, "-c", code], check=True) for code in ("pass", first))
    bare, full = map(median_seconds, runs)
    return f"{(full - bare) * 1e3:7.1f} ms over a bare interpreter"


LINES: list[tuple[str, Callable[[], str]]] = [
    *((f"solve, scene ({name}), mu = {mu:g}", partial(scalar, name, mu)) for name in SCENES for mu in MUS),
    *((f"solve, random starts, mu = {mu:g}", partial(random_starts, mu)) for mu in MUS),
    *((f"solve_many, {box}, mu = {mu:g}", partial(many, box, mu)) for box in BOXES for mu in (1e-3, 1e-6)),
    *((f"affine system, scene (ii), mu = {mu:g}", partial(general, "ii", mu)) for mu in MUS),
    ("import and a first solve", imports),
]


def main(lines: Iterable[tuple[str, Callable[[], str]]] | None = None) -> int:
    """Print the table, line by line as it is measured; return 0."""
    for label, line in lines or LINES:
        print(f"{label:36s} {line()}", flush=True)
    return 0
