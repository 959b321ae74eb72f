"""Every public function refuses an argument of the wrong kind by a class of ours and in one line."""

import time
from collections.abc import Callable
from decimal import Decimal
from fractions import Fraction
from typing import Any

import gmpy2
import mpmath
import numpy as np
import pytest
import sympy as sp
import sympy.physics.units
import sympy.vector
from sweeptext import parse_sweep
from sympy.physics.mechanics import dynamicsymbols

import asympk as ap
from asympk.certify.certificates import certify, cover
from asympk.errors import AsympkError, InputError
from asympk.numbers import short, spells_number
from asympk.output.export import export
from asympk.sweep import run_sweep

x, y, z, F, t = sp.symbols("x y z F t", real=True)
mu, k = sp.symbols("mu k", positive=True)
X, Y, theta = dynamicsymbols("X Y theta")
SCENE = ap.Scene(sigma=1, mu="1e-3", start=(0, "0.2", -1), until=1)
PATH = ap.solve(SCENE)
PK = ap.systems.painleve_klein.system()
FRICTION = {"velocity": z, "force": F, "load": 1, "kinetic": k}
BLOCK = {"slow": {x: z, z: -x + F}, "fast": {}, "frictions": [ap.Friction(**FRICTION)]}
LAGRANGIAN = (X.diff() ** 2 + Y.diff() ** 2) / 2 + theta.diff() ** 2 / 24 - Y
GROUND = {"gap": Y - sp.sin(theta) / 2, "slip": X - sp.cos(theta) / 2, "friction": sp.Symbol("f", positive=True)}
ROD = ap.Mechanism.from_lagrangian(LAGRANGIAN, (X, Y, theta), contact=ap.Contact(**GROUND))
AT = {"X": 0, "Y": "0.4", "theta": "1.1", "X'": -1, "Y'": 0, "theta'": 0}
SMOOTH = ap.System.smooth({x: -x + y}, {y: x - y}, mu)
(PLANE,) = ap.slow_manifolds(SMOOTH, order=1)
SWEEP = parse_sweep("sigma = 1\nmu = 1e-3\nstart = [0, [0, 0.2], -1]\nuntil = 1\n")
ENDLESS: list = [1]
ENDLESS.append(ENDLESS)


CALLS: dict[str, tuple[Callable[..., Any], dict[str, Any]]] = {
    "solve": (ap.solve, {"scene": SCENE, "method": "exact"}),
    "slow_manifolds": (ap.slow_manifolds, {"system": PK}),
    "slow_manifold": (ap.slow_manifold, {"system": SMOOTH, "branch": {y: x}, "order": 1}),
    "critical_manifolds": (ap.critical_manifolds, {"system": PK}),
    "eigenvalues": (ap.eigenvalues, {"system": PK}),
    "eigenvalues of a mode": (lambda mode: ap.eigenvalues(PK, mode=mode), {"mode": "stick"}),
    "stick_regions": (ap.stick_regions, {"system": PK}),
    "jump_map": (ap.jump_map, {"system": PK, "near": "slip_opposite", "arrival": None}),
    "atlas": (ap.atlas, {"system": SMOOTH, "values": {"mu": 1e-3}, "start": {x: 1, y: 1}, "until": 1}),
    "phase": (ap.phase, {"what": SCENE, "x": "x"}),
    "System.smooth": (ap.System.smooth, {"slow": {x: -x}, "fast": {y: x - y}, "small": mu, "time": t}),
    "System.with_frictions": (ap.System.with_frictions, {**BLOCK, "time": t}),
    "Friction": (ap.Friction, FRICTION),
    "lowered": (lambda at: ap.lower((x,), x**2, "math")(at), {"at": 1}),
    "System.mode": (PK.mode, {"name": "stick"}),
    "lower": (ap.lower, {"args": (x,)}),
    "Path.plot": (PATH.plot, {"file": "plot.svg"}),
    "Path.to_csv": (PATH.to_csv, {"file": "path.csv"}),
    "certify": (certify, {"scene": SCENE, "box": {"mu": ("0.001", "0.002")}}),
    "from_lagrangian": (ap.Mechanism.from_lagrangian, {"lagrangian": LAGRANGIAN, "coordinates": (X, Y, theta)}),
    "elastic": (ROD.elastic, {"compliance": sp.Symbol("c", positive=True), "damping": 1}),
    "Mechanism.start": (ROD.start, {"system": ROD.rigid(), "values": AT}),
    "Mechanism.own": (ROD.own, {"thing": x}),
    "Mechanism.keyed": (ROD.keyed, {"values": AT, "others": ()}),
    "least_critical_friction": (ROD.least_critical_friction, {"coordinate": "theta", "values": {}}),
    "reduced_flow": (ap.reduced_flow, {"manifold": PLANE}),
    "integral_curves": (ap.integral_curves, {"manifold": PLANE}),
    "rest_state": (ap.rest_state, {"manifold": PLANE}),
    "export": (export, {"system": SMOOTH, "target": "c", "out": "here", "order": 1, "name": "model"}),
    "run_sweep": (run_sweep, {"sweep": SWEEP, "out": "here"}),
    "a force": (lambda force: ap.Mechanism.from_lagrangian(LAGRANGIAN, (X, Y, theta), forces={X: force},
                                                           contact=ap.Contact(**GROUND)), {"force": 1}),
    "a coordinate": (lambda q: ap.Mechanism.from_lagrangian(LAGRANGIAN, (X, Y, q), contact=ap.Contact(**GROUND)),
                     {"q": theta}),
    "Contact": (ap.Contact, {**GROUND, "static": 2}),
    "gap": (lambda gap: ap.Contact(**{**GROUND, "gap": gap}), {"gap": Y}),
    "slip": (lambda slip: ap.Mechanism.from_lagrangian(LAGRANGIAN, (X, Y, theta),
                                                       contact=ap.Contact(**{**GROUND, "slip": slip})), {"slip": X}),
    "a branch": (lambda h: ap.slow_manifold(SMOOTH, branch={y: h}, order=1), {"h": x}),
    "a place": (lambda at: ap.eigenvalues(SMOOTH, at={x: at, y: at}), {"at": 0}),
    "a key": (lambda key: ROD.motions({**AT, short(key): 1}), {"key": "f"}),
    "motions": (lambda f: ROD.motions({**AT, "f": f}), {"f": 2}),
    "jump_law ratio": (ROD.jump_law, {"ratio": 1}),
    "jump_law damping": (ROD.jump_law, {"damping": 1}),
    "paradox_set": (ROD.paradox_set, {"over": {"theta": [0.1, 1.5]}, "values": {"f": 2}}),
}
FIXED = {"lower": {"expr": x**2}, "from_lagrangian": {"contact": ap.Contact(**GROUND)}}
WRONG = {
    "a word": "no such thing", "a number": -1.5, "nan": float("nan"), "inf": float("inf"), "huge": 10**400,
    "a list": [1, "a", None], "a matrix": np.zeros((2, 3)), "a text of numpy": np.array("a"), "a complex": 1j,
    "a mapping": {"nothing": None}, "an object": object(),
    "a tuple": (1, 2), "a range": range(3), "a truth": True, "infinity in every direction": sp.zoo,
    "a time with a unit": np.timedelta64(5, "ms"), "a matrix of symbols": sp.eye(2), "a scene": SCENE,
    "a friction": ap.Friction(**FRICTION),
    "no number of numpy": np.float32("nan"), "an interval": mpmath.iv.mpf([0, 1]),
    "a decimal of many digits": Decimal("1e99999"), "an integer symbol": sp.Symbol("q", integer=True),
    "a unit": sp.physics.units.meter, "a vector": sp.vector.CoordSys3D("C").i, "a root": sp.CRootOf(x**5 - x - 1, 0),
    "an array of nothing": np.zeros(0), "a condition": x < 1,
    "an integer of very many digits": 10**5000,
    "a function of sympy": sp.S.IdentityFunction, "a list in itself": ENDLESS,
    "a tiny fraction": Fraction(1, 10**400), "a range of sympy": sp.Range(3), "a set of sympy": sp.Interval(0, 1),
}


def refusal(name, argument, value):
    """Return the words in which a value is refused, "" where it is none that can be."""
    call, given = CALLS[name]
    try:
        call(**{**given, **FIXED.get(name, {}), argument: value})
    except AsympkError as error:
        return str(error)
    return ""


@pytest.mark.parametrize(("name", "argument"), [(name, a) for name, (_, given) in CALLS.items() for a in given])
@pytest.mark.few(6)
def test_a_wrong_argument_is_refused_in_one_line(name, argument, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    said = {kind: refusal(name, argument, value) for kind, value in WRONG.items()}
    assert {kind: words for kind, words in said.items() if "\n" in words or len(words) >= 300} == {}


@pytest.mark.parametrize("name", CALLS)
def test_nothing_where_something_is_needed_is_refused(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert refusal(name, next(iter(CALLS[name][1])), [None])


@pytest.mark.parametrize(("rate", "said"), [
    (sp.Limit(sp.sin(k * x) / k, k, 0), "is to be worked out first; give Limit"),
    (sp.Sum(k * x, (k, 0, 3)), "is to be worked out first; give Sum"),
    (sp.MatrixSymbol("M", 2, 2)[0, 0] * x, "is neither a plain number nor a Symbol"), (sp.O(x), "is neither a plain"),
    (sp.IndexedBase("a")[1] - x, "is neither a plain"), (sp.AccumBounds(0, 1), "is neither a plain"),
    (sp.fibonacci(x), r"of fibonacci\(x\) no numbers can be computed; write its formula"),
])
def test_what_has_no_numbers_is_refused_as_a_rate(rate, said):
    with pytest.raises(InputError, match=said):
        ap.solve(ap.Scene(system=ap.System.smooth({x: rate}, {}, None), start={x: 1}, until=1))


def test_a_friction_that_sympy_refuses_at_a_number_is_refused_with_its_reason():
    block = ap.System.with_frictions({x: z, z: -x + F}, {}, [ap.Friction(z, F, 1, sp.factorial2(k))])
    with pytest.raises(InputError, match=r"friction .*factorial2\(k\).* has no value at k = 2.5: argument"):
        ap.Scene(system=block, values={k: "5/2"}, start={x: 1, z: 1}, until=1)


def test_a_mode_has_a_name_and_mappings():
    assert ap.Mode("free", {x: -x}, {}).slow == sp.Dict({x: -x})
    for given, said in ((("free", 3, {}), "mode: slow = 3"), ((3, {}, {}), "mode: name = 3")):
        with pytest.raises(InputError, match=said):
            ap.Mode(*given)


@pytest.mark.parametrize("value", [sp.I, sp.zoo, np.timedelta64(5, "ms"), gmpy2.mpc(1)], ids=repr)
def test_what_is_no_real_number_is_refused_wherever_a_number_stands(value):
    stick = ap.stick_regions(PK).stick
    for call in (
        lambda: ap.Scene(sigma=1, mu="1e-3", start=(0, 0, -1), until=value),
        lambda: ap.solve(SCENE, digits=value),
        lambda: ap.slow_manifolds(PK, order=value),
        lambda: stick.contains(value, sigma=1),
        lambda: ap.Friction(**{**FRICTION, "kinetic": value}),
        lambda: ROD.jump_law(ratio=value),
        lambda: ROD.motions({**AT, "f": value}),
    ):
        with pytest.raises(AsympkError):
            call()


@pytest.mark.parametrize("value", [np.zeros(0), x < 1, "yes", 1, [True]], ids=repr)
def test_a_flag_is_true_or_false_and_progress_is_a_function(value):
    rod, block = (1, 1e-3, 0, 0.2, -1, 1), {"system": SMOOTH, "values": {"mu": 1}, "start": {x: 1, y: 0}, "until": 1}
    for name, call in {
        "unilateral": lambda v: ap.Contact(**GROUND, unilateral=v),
        "branching": lambda v: ap.lower((x,), x, branching=v),
        "events": lambda v: ap.solve_many(*rod, events=v),
        "strict": lambda v: ap.solve_many(**block, strict=v),
    }.items():
        call(np.True_)
        with pytest.raises(InputError, match=rf"{name} = .*: it must be True or False"):
            call(value)
    for call in (lambda v: ap.solve_many(*rod, progress=v), lambda v: ap.solve_many(**block, progress=v),
                 lambda v: ap.solve(SCENE, digits=20, progress=v), lambda v: ap.atlas(*rod, progress=v),
                 lambda v: cover(SCENE, {}, progress=v), lambda v: run_sweep(SWEEP, "here", progress=v)):
        with pytest.raises(InputError, match=r"progress = .*: it must be a function"):
            call(value)


def test_an_integral_is_to_be_worked_out_first():
    u = sp.Symbol("u")
    area = sp.Integral(sp.cos(u), (u, 0, 1))
    with pytest.raises(InputError, match=r"start y = Integral\(.*: work it out first, as \.evalf\(20\) does"):
        ap.Scene(sigma=1, mu="1e-3", start=(0, area, -1), until=1)
    for worked_out in (area.evalf(20), area.doit()):
        read = ap.Scene(sigma=1, mu="1e-3", start=(0, worked_out, -1), until=1)
        assert abs(read.start[1] - sp.sin(1)) < 1e-20


def test_a_long_ratio_is_read_as_fast_as_a_short_one():
    """Its numerator alone is a decimal, too, which must not be looked for at each of its digits."""
    begin = time.process_time()
    assert spells_number("3" * 3990 + "/7")
    assert time.process_time() - begin < 0.05
