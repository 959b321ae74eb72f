"""An exported module stands alone, and computes what asympk computes."""

import ctypes
import importlib.util
import inspect
import itertools
import math
import random
import re
import shutil
import subprocess
import sys

import pytest
import sympy as sp
from mechanisms import slender_rod

import asympk as ap
from asympk.errors import InputError, NotDerivable, UnknownName
from asympk.formulas import formula_in_words, read_formula
from asympk.output.export import export, module_functions
from asympk.symbolic import diffring
from asympk.symbolic.expansion import expand
from asympk.symbolic.lowering import lower
from asympk.systems import arm

PK = ap.systems.painleve_klein.system()
COMPILER = shutil.which("cc") or shutil.which("gcc")
u, v, w, r = sp.symbols("u v w r")
mu = sp.Symbol("mu", positive=True)
VAN_DER_POL = ap.System.smooth({u: v}, {v: (1 - u**2) * v - u}, mu)
TWO_FAST = ap.System.smooth({u: sp.exp(-r * u)}, {v: u - v, w: v - 2 * w}, mu)
LEANING = slender_rod().elastic(compliance=sp.Symbol("eps", positive=True), damping=sp.Symbol("h", positive=True))
F, G = sp.symbols("F G")
DISCS = [ap.Friction(slip, force, load=1, kinetic=1) for slip, force in ((u - v, F), (v - w, G))]
CLUTCHES = ap.System.with_frictions({u: r + F, v: -F + G, w: -G}, {}, DISCS)
SYSTEMS = {"pk": PK, "vdp": VAN_DER_POL, "two": TWO_FAST, "leaning": LEANING, "clutches": CLUTCHES}
EACH = [pytest.param(name, marks=[pytest.mark.slow] * (name == "leaning")) for name in SYSTEMS]


def points(function, count=20):
    """Values for the arguments of a function of the Painlevé-Klein system, mu small enough for real eigenvalues."""
    rng = random.Random(7)
    ranges = {"mu": (1e-3, 0.1), "sigma": (0.5, 3), "sigma0": (0.5, 3)}
    return [[rng.uniform(*ranges.get(a.name, (0.1, 0.9))) for a in function.args] for _ in range(count)]


def python_module(path):
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("name", EACH)
@pytest.mark.few(2)
def test_the_python_module_computes_what_lower_does(name, tmp_path):
    (path,) = export(SYSTEMS[name], "python", tmp_path, name=name)
    module = python_module(path)
    for f in module_functions(SYSTEMS[name], order=3):
        expected = lower(f.args, f.values, "math", definitions=f.definitions)
        for values in points(f):
            assert getattr(module, f.name)(*values) == expected(*values)


@pytest.mark.skipif(COMPILER is None, reason="there is no C compiler")
@pytest.mark.parametrize("whole", [True, False])
def test_a_source_does_not_compile_with_the_header_of_another_export(tmp_path, whole):
    export(VAN_DER_POL, "c", tmp_path)
    old = (tmp_path / "model.c").read_text()
    export(TWO_FAST, "c", tmp_path)
    if not whole:  # as an interruption after the header leaves it
        (tmp_path / "model.c").write_text(old)
    run = subprocess.run([COMPILER, "-c", "-o", tmp_path / "model.o", tmp_path / "model.c"], capture_output=True)
    assert (run.returncode == 0, b"model.h is of another export; write both again" in run.stderr) == (whole, not whole)


@pytest.mark.skipif(COMPILER is None, reason="there is no C compiler")
@pytest.mark.parametrize("name", EACH)
@pytest.mark.few(2)
def test_the_c_module_compiles_without_a_warning_and_computes_what_lower_does(name, tmp_path):
    export(SYSTEMS[name], "c", tmp_path, name=name)
    library = tmp_path / f"{name}.so"
    flags = ["-std=c99", "-O2", "-Wall", "-Wextra", "-pedantic", "-Werror", "-shared", "-fPIC"]
    subprocess.run([COMPILER, *flags, "-o", library, tmp_path / f"{name}.c", "-lm"], check=True)
    compiled = ctypes.CDLL(str(library))
    for f in module_functions(SYSTEMS[name], order=3):
        expected = lower(f.args, f.values, "math", definitions=f.definitions)
        for values in points(f):
            found = call(compiled[f"{name}_{f.name}"], values, f.values)
            wanted = expected(*values)
            for a, b in zip(found, wanted if isinstance(wanted, tuple) else (wanted,), strict=True):
                assert math.isclose(a, b, rel_tol=1e-11, abs_tol=1e-12)


@pytest.mark.further
def test_straight_line_code_gives_the_coefficients_of_the_series():
    functions = {f.name: f for f in module_functions(LEANING, order=2)}
    for m in ap.slow_manifolds(LEANING, order=2):
        f = functions[f"{m.name}_series"]
        assert len(f.definitions) > 20
        plain = {s: a for s in LEANING.states for a in f.args if a.name == s.name.replace("'", "_rate")}
        series = lower(f.args, [c.xreplace(plain) for c in m.coefficients], "mpmath")
        written = lower(f.args, f.values, "mpmath", definitions=f.definitions)
        for values in points(f, 3):
            pairs = zip(written(*values), series(*values), strict=True)
            assert all(abs(a - b) < 1e-12 * (1 + abs(b)) for a, b in pairs)


@pytest.mark.further
@pytest.mark.parametrize("terms", [5, pytest.param(20, marks=pytest.mark.slow)])
def test_coefficients_of_many_terms_are_written_in_steps(terms, tmp_path):
    """mu y' = g(x) - y has y = g - mu g' x' + ...; over one denominator five quotients in x' took minutes."""
    x, y, mu = sp.symbols("x y mu", real=True)
    own = sp.symbols(f"a:{terms}", positive=True)
    height = sum(a * x / (1 + a**2 * x**2) for a in own)
    flow = sum(x / (1 + a * y**2) for a in own)
    export(ap.System.smooth({x: flow}, {y: height - y}, mu), "python", tmp_path, order=1)
    space = {}
    exec((tmp_path / "model.py").read_text(), space)
    place = {x: sp.Rational(1, 3)} | {a: sp.Rational(k + 2, 7) for k, a in enumerate(own)}
    expected = height, -height.diff(x) * flow.subs(y, height)
    names = inspect.signature(space["Pi1_series"]).parameters
    found = space["Pi1_series"](*(float({str(s): v for s, v in place.items()}[name]) for name in names))
    assert found == pytest.approx([float(e.subs(place)) for e in expected], rel=1e-12)


def test_straight_line_code_takes_the_sign_of_the_velocity_from_its_argument():
    # a long Stribeck law, whose manifold of order 0 is known: the load is (1 + rate) / (2 + f (1 + exp(-|z|)))
    x, y, z, q, f, small, force = sp.symbols("x y z q f mu F", real=True)
    rate = sum(sp.sin(k * q) * sp.exp(-k * x) for k in range(1, 12))
    kinetic = f * (1 + sp.exp(-sp.Abs(z)))
    system = ap.System.with_friction({x: y, q: z}, {y: 1 + rate - 2 * (x + y) + force}, velocity={z: 1 - x - y + force},
                                     force=force, load=x + y, kinetic=kinetic, static=3 * f, small=small)
    series = next(f for f in module_functions(system, order=1) if f.name == "Pi1_series")
    written = lower(series.args, series.values, "math", branching=True, definitions=series.definitions)
    for velocity in (0.7, -0.7):
        place = {"x": 0.3, "q": 0.4, "z": velocity, "f": 0.5}
        (value, _), at = written(*(place[a.name] for a in series.args)), {x: 0.3, q: 0.4}
        load = (1 + rate.subs(at)) / (2 + 0.5 * (1 + math.exp(-0.7)))
        assert value == pytest.approx(float(load) - 0.3)


def test_an_exported_slow_manifold_is_the_sum_of_its_powers_of_mu(tmp_path):
    at, small, rate = 0.3, 0.1, math.exp(-0.6)
    first, second = (python_module(*export(SYSTEMS[n], "python", tmp_path, name=n, order=1)) for n in ("vdp", "two"))
    by_hand = at / (1 - at**2) + small * at * (1 + at**2) / (1 - at**2) ** 4  # v_1 = v_0 v_0' / (1 - u^2)
    assert first.Pi1(at, small) == pytest.approx(by_hand, rel=1e-14)
    by_hand = (at - small * rate, at / 2 - 3 * small * rate / 4)  # v = u - mu v', 2 w = v - mu w', u' = exp(-2 u)
    assert second.Pi1(at, small, 2) == pytest.approx(by_hand, rel=1e-14)


@pytest.mark.further
def test_the_slow_manifold_of_an_arm_is_written_and_its_residual_is_of_the_order_that_is_omitted(tmp_path):
    system, order = arm.system(), 2
    (path,) = export(system, "python", tmp_path, order=order)
    module, values = python_module(path), dict(arm.VALUES) | {"h": 0.5, "S": -3.0, "E": -1.0}
    names = [s.name.replace("'", "_rate") for s in system.states]
    place = {"a": 1.25, "b": 0.8, "x": 0.7, "a_rate": 0.45, "b_rate": -0.6, "z": -0.3}

    def call(name, **given):
        function = getattr(module, name)
        return function(*(({**values, **given})[a] for a in inspect.signature(function).parameters))

    def residual(small):
        y = call("Pi1", **place, c=small)
        rates = dict(zip(names, call("slip_same", **place, y=y, c=small), strict=True))
        slope = (call("Pi1", **{s: v + 1e-4 * rates[s] for s, v in place.items()}, c=small)
                 - call("Pi1", **{s: v - 1e-4 * rates[s] for s, v in place.items()}, c=small)) / 2e-4
        return small * (slope - rates["y"])

    assert residual(1e-2) / residual(5e-3) == pytest.approx(2 ** (order + 1), rel=0.1)


def test_a_rate_with_a_prime_has_a_plain_name_in_a_module_that_says_so(tmp_path):
    theta = sp.Symbol("theta'")
    falling = ap.System.smooth({theta: -theta, sp.Symbol("theta_rate"): theta}, {}, None)
    (path,) = export(falling, "python", tmp_path)
    assert "theta_rate_ stands for theta'" in path.read_text()
    assert python_module(path).smooth(2.0, 3.0) == (-2.0, 2.0)


def test_letters_beyond_ascii_have_their_names_in_a_module_that_says_so(tmp_path):
    angle, rate, end = sp.symbols("\u03b8 \u03b8' \u0398\u2081", real=True)
    swing = ap.System.smooth({angle: rate, rate: -end * sp.sin(angle)}, {}, None)
    text = export(swing, "c", tmp_path)[0].read_text()
    put = {"theta": angle, "theta_rate": rate, "Theta1": end}
    assert all(f"{plain} stands for {given}" in text for plain, given in put.items())
    assert " * model: a system, written by" in text
    assert "void model_smooth(double theta, double theta_rate, double Theta1, double out[2]);" in text


def test_letters_of_one_name_have_different_plain_names(tmp_path):
    one, other = sp.symbols("\u03b8 \u03d1", real=True)
    (path,) = export(ap.System.smooth({one: other, other: 2 * one}, {}, None), "python", tmp_path)
    assert python_module(path).smooth(2.0, 3.0) == (3.0, 4.0)


def call(function, values, outputs):
    single = isinstance(outputs, sp.Expr)
    out = [] if single else [(ctypes.c_double * len(outputs))()]
    function.restype = ctypes.c_double if single else None
    result = function(*map(ctypes.c_double, values), *out)
    return (result,) if single else tuple(out[0])


@pytest.mark.parametrize("force", [v - v**3 / 3 - u, u - v - v**5, u - v - sp.exp(v), u - v - sp.sin(v) / 2])
@pytest.mark.few(2)
def test_a_branch_that_no_real_formula_gives_is_written_by_its_own_value(force, tmp_path):
    system = ap.System.smooth({u: v - r * u}, {v: force}, mu)
    (path,) = export(system, "python", tmp_path)
    module = python_module(path)
    branch, rate, at = 1.5, 0.25, {v: sp.Rational(3, 2), r: sp.Rational(1, 4)}
    there = {u: sp.solve(force, u)[0].subs(at), **at}
    slope = -force.diff(u) / force.diff(v)  # mu h' u' = g gives h_1 = h_0' u' / g_v
    wanted = float((slope * (v - r * u) / force.diff(v)).subs(there))
    series = module.Pi_smooth_series if force.has(sp.exp) else module.Pi1_series
    assert series(branch, rate)[:2] == pytest.approx((branch, wanted))


@pytest.mark.skipif(shutil.which("g++") is None, reason="there is no C++ compiler")
def test_the_header_serves_cpp_too(tmp_path):
    export(PK, "c", tmp_path, name="pk")
    (tmp_path / "use.cpp").write_text('#include "pk.h"\nint main() { return pk_stick_slow_eigenvalue(0.1) > 0; }\n')
    subprocess.run(["g++", "-Wall", "-Werror", "-fsyntax-only", tmp_path / "use.cpp"], check=True)


def test_the_python_module_needs_nothing_but_math(tmp_path):
    export(PK, "python", tmp_path)
    code = "import sys, model; model.Pi1_exact(1.0, 0.1, 1.0); print(*{'sympy', 'numpy', 'asympk'} & {*sys.modules})"
    run = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, check=True, text=True)
    assert run.stdout.strip() == ""
    text = (tmp_path / "model.py").read_text()
    assert [line for line in text.splitlines() if line.startswith(("import", "from"))] == ["import math"]


def test_the_module_has_fields_manifolds_eigenvalues_and_edges():
    names = {f.name for f in module_functions(PK, order=1)}
    assert {"slip_same", "slip_opposite", "stick", "stick_edges"} <= names
    assert {f"{m}{part}" for m in ("Pi1", "Pi2") for part in ("", "_series", "_exact")} <= names
    assert {f"{m}_{kind}_eigenvalue" for m in ("slip_same", "stick") for kind in ("slow", "fast")} <= names


def test_an_eigenvalue_says_where_it_is_real():
    """mu lambda^2 + b (lambda + 1) = 0 has the discriminant b (b - 4 mu); b is sigma + 4, -sigma and 1 for the rod."""
    told = {f.name: f.meaning for f in module_functions(PK, order=0)}
    bounds = {"slip_same": "4*mu/(sigma + 4)", "slip_opposite": "-4*mu/sigma", "stick": "4*mu"}
    for (mode, bound), kind in itertools.product(bounds.items(), ("slow", "fast")):
        assert told[f"{mode}_{kind}_eigenvalue"] == f"the {kind} eigenvalue of {mode}; real while {bound} <= 1"


def test_states_come_in_the_order_of_a_start():
    field = next(f for f in module_functions(PK, order=0) if f.name == "slip_same")
    assert [a.name for a in field.args] == ["x", "y", "z", "mu", "sigma"]


def test_the_heading_states_the_equations(tmp_path):
    (path,) = export(VAN_DER_POL, "python", tmp_path)
    assert "    du/dt = v\n    mu dv/dt = -u + v*(1 - u**2)\n" in path.read_text()


def test_exporting_twice_gives_the_same_bytes(tmp_path):
    for target in ("c", "python"):
        first = [path.read_bytes() for path in export(PK, target, tmp_path / "a")]
        assert first == [path.read_bytes() for path in export(PK, target, tmp_path / "b")]


def test_bad_input_is_one_line_and_writes_nothing(tmp_path):
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(InputError, match="file cannot be written"):
        export(PK, "c", tmp_path / "file")
    with pytest.raises(UnknownName, match="choose one of c, python"):
        export(PK, "rust", tmp_path)
    with pytest.raises(InputError, match="cannot name a module"):
        export(PK, "c", tmp_path, name="my-model")
    with pytest.raises(ap.errors.OrderError):
        export(PK, "c", tmp_path, order=-1)
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


@pytest.mark.parametrize("inside", ["", "deep/within"])
def test_a_file_in_place_of_the_directory_is_refused_before_anything_is_derived(inside, tmp_path, monkeypatch):
    (tmp_path / "file").write_text("kept")
    monkeypatch.setattr("asympk.output.export.module_functions", lambda *_: pytest.fail("derived"))
    with pytest.raises(InputError, match=r"cannot be written .*file is a file"):
        export(PK, "c", tmp_path / "file" / inside)


def test_rates_too_long_for_slow_manifolds_are_refused_before_anything_is_derived():
    x, y, mu = sp.symbols("x y mu", real=True)
    waves = x
    for _ in range(13):
        waves = sp.sin(waves) + waves**2
    with pytest.raises(ap.errors.NotDerivable, match="the rates of smooth have more than 10000 operations"):
        module_functions(ap.System.smooth(slow={x: y}, fast={y: waves - y}, small=mu), 1)


def test_a_rate_with_the_sign_of_its_velocity_is_exported_for_both_signs(tmp_path):
    x, z, F = sp.symbols("x z F", real=True)
    law = ap.Friction(force=F, velocity=z, load=x, kinetic=3 + sp.sign(z))
    (path,) = export(ap.System.with_frictions({x: z, z: F}, {}, [law]), "python", tmp_path)
    space = {}
    exec(path.read_text(encoding="utf-8"), space)
    assert (space["slip_same"](2, 1)[1], space["slip_same"](-2, -1)[1]) == (-8, 4)


@pytest.mark.parametrize("target", ["c", "python"])
def test_the_heading_has_conditions_as_sentences(target, tmp_path):
    """They were spelt Eq(z, 0) & (Abs(x - 1) <= ...), as nowhere else."""
    x, z, F = sp.symbols("x z F", real=True)
    f, f0 = sp.symbols("f f_0", positive=True)
    law = ap.Friction(force=F, velocity=z, load=x, kinetic=f, static=f0)
    system = ap.System.with_frictions({x: z, z: F - sp.cbrt(sp.Abs(x)) * sp.sign(x)}, {}, [law], assumptions=f0 >= f)
    text = export(system, target, tmp_path)[-1].read_text(encoding="utf-8")
    assert "stick, where z = 0 and " in text
    assert f"assumed: {formula_in_words(system.assumptions)}" in text
    assert not re.search(r"\b(Eq|Ne|And|Or)\(| [&|] ", text[:text.index("def " if target == "python" else "#include")])


def test_a_manifold_of_one_side_says_where_it_holds(tmp_path):
    x, y = sp.symbols("x y", real=True)
    (path,) = export(ap.System.smooth({x: -y}, {y: sp.Max(x, 0) - y}, mu), "python", tmp_path)
    text = path.read_text(encoding="utf-8")
    assert "slow manifold of smooth, where x > 0, to order 3" in text
    assert "slow manifold of smooth, where x < 0, to order 3" in text


def test_what_has_no_stick_regions_is_exported_without_their_edges(tmp_path):
    rod = slender_rod().rigid()
    (path,) = export(rod, "python", tmp_path)
    space = {}
    exec(path.read_text(encoding="utf-8"), space)
    assert {mode.name for mode in rod.modes} <= space.keys()
    assert "stick_edges" not in space


@pytest.mark.parametrize("velocity", [1 + u**2, u + sp.tanh(u) - 2, u**2 - 1])
@pytest.mark.few(1)
def test_a_system_without_one_plane_of_rest_is_exported_without_edges(velocity, tmp_path):
    friction = ap.Friction(velocity=velocity, force=F, load=1, kinetic=1)
    system = ap.System.with_frictions({u: v, v: F - u}, {}, [friction])
    (path,) = export(system, "python", tmp_path)
    assert "stick_edges" not in vars(python_module(path))
    with pytest.raises(ap.errors.NotDerivable, match=r"the sliding velocity .*: regions need"):
        ap.stick_regions(system)


def test_a_real_cube_root_is_printed_as_it_is_written(tmp_path):
    x, v = sp.symbols("x v", real=True)
    rate = read_formula("2*x*cbrt(v) - cbrt(x - 1)*cbrt(v)", {"x": x, "v": v})
    system, mu = ap.System.smooth({x: rate, v: -x}, {}, None), sp.Symbol("mu", positive=True)
    told = "2*x*cbrt(v) - cbrt(v)*cbrt(x - 1)"
    assert told in repr(system)
    assert repr(ap.System.smooth({v: -x}, {x: rate}, mu).modes[0]).count(told) == 1
    assert f"dx/dt = {told}\n" in export(system, "python", tmp_path)[0].read_text()


@pytest.mark.parametrize("force", [v**2 - u - 1, u - w - 2 * v - sp.sin(u * w), u + sp.exp(w) - v - v**3])
def test_coefficients_that_are_too_long_in_symbols_are_exported_as_straight_line_code(monkeypatch, tmp_path, force):
    """Those of u' = u - tanh(u w) atan(e^v) + asinh(u), w' = sin(u (1 + v) atan(v)) to order 3 did not end."""
    system, place = ap.System.smooth({u: v - w, w: sp.cos(u + v)}, {v: force}, mu), {w: 0.2, v: 1.1}
    place[u] = place[v] + place[v] ** 3 - math.exp(place[w])  # on the implicit branch of the cubic
    expected = [[float(c.subs(place)) for c in m.coefficients] for m in ap.slow_manifolds(system, order=3)]
    monkeypatch.setattr(diffring, "WORK", 10)
    expand.cache_clear()
    (path,) = export(system, "python", tmp_path)
    module = python_module(path)
    functions = [getattr(module, name) for name in dir(module) if name.endswith("_series")]
    arguments = ([place[sp.Symbol(name)] for name in inspect.signature(f).parameters] for f in functions)
    for f, at, coefficients in zip(functions, arguments, expected, strict=True):
        assert f(*at) == pytest.approx(coefficients, rel=1e-12, abs=1e-12)
    with pytest.raises(NotDerivable, match="too long to be written in symbols"):
        ap.slow_manifolds(system, order=3)[0].coefficient(1)
    assert "too long to be written" in repr(ap.slow_manifolds(system, order=3)[0])
