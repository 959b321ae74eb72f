"""A string is a number or nothing: whatever function it is given to, none is evaluated, and refusing takes no time."""

import ast
import signal
from contextlib import contextmanager
from fractions import Fraction
from pathlib import Path

import pytest
import sympy as sp
from parsed import parsed
from sweeptext import parse_sweep

import asympk as ap
from asympk.asymptotics.jump import OFFSET
from asympk.asymptotics.series import series
from asympk.certify import certify, cover
from asympk.output.export import module_functions
from asympk.pictures.trace import trace
from asympk.studies import divide
from asympk.symbolic.stability import series_in_mu
from asympk.systems import painleve_klein as pk
from asympk.systems.painleve_klein import rod, units

SECONDS = 2
WITNESS = "evaluated"
HOSTILE = [
    "__import__('pathlib').Path('evaluated').touch()", "open('evaluated', 'w')", "9**9**9", "1e99999999", "1e-99999999",
    "1/0", "1/3/4", "nan", "inf", "oo", "zoo", "1j", "pi", "sqrt(2)", "x", "0x10", "1_0", "", "1" * 1_000_000,
    "1e99999999/3", "lambda: 0",
]

FORMULAS = ("1/3/4", "pi", "sqrt(2)")  # numbers in a file, which a sweep is read from

SYSTEM = pk.system()
X, Y, MU = sp.symbols("x y mu")
SMOOTH = ap.System.smooth(slow={X: Y}, fast={Y: X - Y}, small=MU)
SCENE = {"sigma": 1, "mu": "1e-3", "start": (0, "0.2", -1), "until": 5}
MANY = {"sigma": 1, "mu": 1e-3, "x": 0, "y": 0.2, "z": -1, "until": 5, "sigma0": 1}
NEAR = {"manifold": "Pi2", "x": 0.3, "offset": 0, "z": 1, "sigma": 1, "mu": 1e-3, "until": 5, "sigma0": 1}
ONE = ap.Scene(**SCENE)
PATH = ap.solve(ONE)
SPECTRUM = ap.eigenvalues(SYSTEM)[0]


def _with(function, given, name, *more, **options):
    return lambda text: function(*more, **{**given, **options, name: text})


U, V, FORCE = sp.symbols("u v F", real=True)
SMALL = sp.Symbol("c", positive=True)
FRICTION = {"velocity": V, "force": FORCE, "load": 1, "kinetic": 1}
CONTACT = {"gap": U, "slip": X, "friction": 1, "load": 1}
BEAD = ap.Mechanism((X, U), (V, sp.Symbol("w")), sp.Matrix([[2, 1], [1, 2]]), (0, -1), ap.Contact(**CONTACT))


CALLS = {
    **{f"Friction {name}": _with(ap.Friction, FRICTION, name) for name in FRICTION},
    **{f"Contact {name}": _with(ap.Contact, CONTACT, name) for name in CONTACT},
    **{f"elastic {name}": _with(BEAD.elastic, {"compliance": SMALL, "damping": 1}, name)
       for name in ("compliance", "damping")},
    "jump_law damping": lambda text: BEAD.jump_law(damping=text),
    "System assumptions": lambda text: ap.System.smooth({X: U}, {U: -U}, SMALL, assumptions=text),
    "Scene values": lambda text: ap.Scene(system=SYSTEM, values={"mu": text, "sigma": 1, "sigma0": 1}, start=(0, 0, 1),
                                          until=1),
    **{f"Scene {name}": _with(ap.Scene, SCENE, name) for name in (*SCENE, "sigma0")},
    **{f"Scene start {k}": lambda text, k=k: ap.Scene(1, 1, tuple(text if i == k else 1 for i in range(3)), 1)
       for k in range(3)},
    **{f"Scene.near {name}": _with(ap.Scene.near, NEAR, name) for name in NEAR},
    **{f"solve_many {name}": _with(ap.solve_many, MANY, name) for name in MANY},
    **{f"solve_many jump {name}": _with(ap.solve_many, MANY, name, method="jump") for name in (*MANY, "order")},
    "solve_many list": lambda text: ap.solve_many(1, 1e-3, [0, text], 0.2, -1, 5),
    **{f"atlas {name}": _with(ap.atlas, MANY, name) for name in (*MANY, "rtol")},
    "solve digits": lambda text: ap.solve(ONE, digits=text),
    "solve jump digits": lambda text: ap.solve(ONE, "jump", digits=text),
    "solve jump order": lambda text: ap.solve(ONE, "jump", order=text),
    "solve method": lambda text: ap.solve(ONE, text),
    **{f"solve {m} {name}": lambda text, m=m, name=name: ap.solve(ONE, m, **{name: text}) for m, name in (
        ("rk45", "rtol"), ("lsoda", "atol"), ("rk45", "steps"), ("rk45", "seconds"), ("rk45", "events"),
        ("moreau", "step"), ("moreau", "steps"), ("moreau", "seconds"), ("moreau", "prefer"), ("tanh", "eps"),
        ("tanh", "steps"), ("tanh", "solver"), ("sign", "seconds"))},
    "path at": PATH,
    "path at a list": lambda text: PATH([0, text]),
    "path of digits at": ap.solve(ONE, digits=20),
    "path of a model at": ap.solve(ONE, "jump"),
    "least_model": lambda text: ap.least_model(ONE, text),
    "slow_manifolds": lambda text: ap.slow_manifolds(SYSTEM, order=text),
    "slow_manifold order": lambda text: ap.slow_manifold(SMOOTH, {Y: X}, order=text),
    "slow_manifold branch": lambda text: ap.slow_manifold(SMOOTH, {Y: text}),
    "coefficient": lambda text: ap.slow_manifolds(SYSTEM)[0].coefficient(text),
    "at": lambda text: ap.slow_manifolds(SYSTEM)[0].at(sigma=text),
    "kind sigma": lambda text: SPECTRUM.kind(sigma=text, mu="1/100"),
    "kind mu": lambda text: SPECTRUM.kind(sigma=1, mu=text),
    "series_in_mu": lambda text: series_in_mu("slow", SPECTRUM, text),
    "contains": lambda text: ap.stick_regions(SYSTEM).stick.contains(text, sigma=1),
    "contains sigma": lambda text: ap.stick_regions(SYSTEM).stick.contains(1, sigma=text),
    "contains sigma0": lambda text: ap.stick_regions(SYSTEM).stick.contains(1.5, sigma=1, sigma0=text),
    "spans": lambda text: ap.stick_regions(SYSTEM).up.spans(sigma=text),
    "spans sigma0": lambda text: ap.stick_regions(SYSTEM).up.spans(sigma=1, sigma0=text),
    "jump_map order": lambda text: ap.jump_map(SYSTEM, order=text),
    "jump_map start": lambda text: ap.jump_map(SYSTEM, start={pk.z: text}),
    "jump_map offset": lambda text: ap.jump_map(SYSTEM, start={OFFSET: text}, near="slip_opposite"),
    "jump series": lambda text: ap.jump_map(SYSTEM, order=0).x(text),
    "series": lambda text: series({(1, 1): 1})(text),
    **{f"lower {target}": lambda text, target=target: ap.lower((X,), 2 * X, target)(text)
       for target in ("numpy", "math", "mpmath")},
    "lower to digits": lambda text: ap.lower((X,), 2 * X, "mpmath").to_digits(30, text),
    "lower expr": lambda text: ap.lower((X,), text),
    "lower exprs": lambda text: ap.lower((X,), [X, text]),
    "lower Dict": lambda text: ap.lower((X,), {X: text}),
    "lower args": lambda text: ap.lower((text,), X),
    "lower target": lambda text: ap.lower((X,), X, text),
    "lower name": lambda text: ap.lower((X,), X, name=text + "("),
    "System fast": lambda text: ap.System.smooth(slow={X: Y}, fast={Y: text}, small=MU),
    "System slow": lambda text: ap.System.smooth(slow={X: text}, fast={Y: X - Y}, small=MU),
    "law": rod.elastic_rod,
    "certify box": lambda text: certify(ONE, {"mu": (text, "1e-2")}),
    "certify digits": lambda text: certify(ONE, digits=text),
    "cover pieces": lambda text: cover(ONE, {"mu": ("1e-3", "2e-3")}, text),
    "export order": lambda text: module_functions(SMOOTH, text),
    "escapes": lambda text: divide.escapes(1, "1e-3", 0, 1, [text]),
    "escapes digits": lambda text: divide.escapes(1, "1e-3", 0, 1, ["1e-2"], text),
    "units": lambda text: units.quantity("m", text),
    "units angle": lambda text: units.quantity("alpha", f"{text} deg"),
    "trace": lambda text: trace(PATH, samples=text),
    "sweep": lambda text: parse_sweep(f'sigma = """{text}"""\nmu = 1e-3\nstart = [0, 0.2, -1]\nuntil = 5'),
}

# whatever else is public takes no number
WITHOUT = {"AsympkError", "Mode", "phase", "Mechanism", "Path", "Event", "System", "critical_manifolds",
           "reduced_flow", "integral_curves", "rest_state", "read_scene", "claims", "systems", "errors",
           "stick_regions", "eigenvalues"}


@contextmanager
def seconds(limit):
    def late(*_):
        raise TimeoutError(f"not refused within {limit} s of computing")

    before = signal.signal(signal.SIGPROF, late)
    signal.setitimer(signal.ITIMER_PROF, limit)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)


@pytest.mark.parametrize("call", CALLS)
@pytest.mark.few(6)
def test_a_hostile_string_is_refused_at_once_in_one_line(call, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for text in HOSTILE:
        if call == "sweep" and text in FORMULAS:
            continue
        with seconds(SECONDS), pytest.raises(ap.AsympkError) as refusal:
            CALLS[call](text)
        assert "\n" not in str(refusal.value)
        assert len(str(refusal.value)) < 400
        assert not Path(WITNESS).exists()


def test_every_public_name_that_takes_a_number_is_in_this_list():
    walked = {call.split()[0].partition(".")[0] for call in CALLS}
    assert {*ap.__all__} <= walked | WITHOUT


@pytest.mark.parametrize("text", ["0.5", "1/2", "5e-1", " +0.5 "])
def test_what_a_string_spells_is_taken_exactly_wherever_a_number_is(text):
    half = sp.Rational(1, 2)
    assert ap.Scene(**{**SCENE, "sigma": text}).sigma == Fraction(1, 2)
    assert ap.slow_manifolds(SYSTEM)[1].at(sigma=text).branch == ap.slow_manifolds(SYSTEM)[1].at(sigma=half).branch
    assert SPECTRUM.kind(sigma=text, mu=text) == SPECTRUM.kind(sigma=half, mu=half)
    assert ap.stick_regions(SYSTEM).stick.contains(text, sigma=text) is True
    assert ap.lower((X,), 2 * X, "mpmath")(text) == 1
    assert series({(1, 0): 2})(text) == 1


@pytest.mark.slow
def test_no_module_hands_text_to_sympy_or_to_the_interpreter():
    package = Path(ap.__file__).parent
    for path in package.rglob("*.py"):
        for node in ast.walk(parsed(path.read_text())):
            if not isinstance(node, ast.Call):
                continue
            name = getattr(node.func, "attr", getattr(node.func, "id", ""))
            assert getattr(node.func, "id", "") != "eval", path  # a Poly has a method of that name
            assert name not in ("parse_expr", "nsimplify"), path
            if name == "sympify":
                assert any(keyword.arg == "strict" for keyword in node.keywords), path
            if name == "exec":  # what these write themselves
                assert path.stem in ("lowering", "compiled", "exact", "tape", "nonstiff", "systempages"), path
