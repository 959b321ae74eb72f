r"""Write a system as a stand-alone module, in C99 or Python, that needs neither asympk nor SymPy.

The module has functions for the rates of every mode (x' and y' = g / mu); for every slow manifold (the coefficients of
its series in mu, the truncated sum, and the exact form where there is one); for the slow and the fast eigenvalue of
every mode that has just these two; and for the loads at which stick can end. Where a branch has no formula in real
numbers, such as a root of a cubic, its functions take the fast states on the branch as arguments.

``module_functions`` returns the functions for any target; ``_manifolds`` and what it calls are the hard part.
"""

from contextlib import suppress
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path

import sympy as sp

from asympk import __version__
from asympk.asymptotics.fibre import formulas
from asympk.asymptotics.tape import Definitions
from asympk.errors import InputError, NotDerivable, NotNormallyHyperbolic
from asympk.formulas import formula_in_words
from asympk.naming import named
from asympk.numbers import known_order, short
from asympk.storage.files import named_file, write_text
from asympk.symbolic.expansion import fast_jacobian, has_long_coefficients, is_implicit, one_side
from asympk.symbolic.long import heavy, is_longer
from asympk.symbolic.lowering import lower, plain_names_of
from asympk.symbolic.manifold import slow_manifold, slow_manifolds
from asympk.symbolic.stability import LAMBDA, Eigenvalues, eigenvalues
from asympk.symbolic.stick import stick_regions
from asympk.symbolic.system import System, require_system

MOST = 10_000  # operations in the rates of one mode: the slow manifolds of longer rates take minutes


@dataclass(frozen=True)
class Function:
    """One function of the module: it assigns ``definitions`` in turn and returns ``values``, one expression or more."""

    name: str
    meaning: str
    args: tuple[sp.Symbol, ...]
    values: sp.Expr | tuple[sp.Expr, ...]
    definitions: Definitions = ()


def export(system: System, target: str, out: str | Path, order: int = 3, name: str = "model") -> tuple[Path, ...]:
    """Write ``system`` to the directory ``out`` and return the paths: ``name.h`` and ``name.c``, or ``name.py``.

    Slow manifolds are expanded to ``order`` in the small parameter. Raises ``InputError`` when ``out`` cannot be
    written or ``name`` cannot name a module, ``UnknownName`` for a target other than ``"c"`` and ``"python"``, and
    ``NotDerivable`` for rates of more than ``MOST`` operations.
    """
    require_system(system, "export")
    target, folder = named("target", target, _WRITERS), named_file(out)
    if not (isinstance(name, str) and name.isidentifier() and name.isascii()):
        raise InputError(f"name {short(name)} cannot name a module; give letters, digits and underscores")
    if not (nearest := next(place for place in (folder, *folder.absolute().parents) if place.exists())).is_dir():
        raise InputError(f"{out} cannot be written ({nearest} is a file); give another directory")
    functions = module_functions(system, order)
    files = _WRITERS[target](name, _heading(system, name), functions)
    try:
        return tuple(write_text(folder / file, text) for file, text in files.items())
    except OSError as reason:
        raise InputError(f"{out} cannot be written ({reason.strerror}); give another directory") from None


def module_functions(system: System, order: int) -> tuple[Function, ...]:
    """Return the functions that make up the module, the same for every target.

    Names become identifiers: the rate theta' is called theta_rate, an angle with a Greek letter, theta, and the
    mode slip_same+stick, slip_same_stick.
    """
    put, order = plain_names_of((*system.states, *system.parameters)), known_order(order)
    if long := [m.name for m in system.modes if is_longer(sp.Tuple(*m.slow.values(), *m.fast.values()), MOST)]:
        raise NotDerivable(f"the rates of {long[0]} have more than {MOST} operations, too many to export; choose "
                           "coordinates in which gap and slip are shorter")
    found = (*_fields(system), *_manifolds(system, order), *_spectra(system), *_edges(system))
    return tuple(_plainly(f, put) for f in found)


def _plainly(f, put):
    values = tuple(v.xreplace(put) for v in f.values) if isinstance(f.values, tuple) else f.values.xreplace(put)
    definitions = tuple((t, e.xreplace(put)) for t, e in f.definitions)
    args = tuple(a.xreplace(put) for a in f.args)
    return Function(f.name.replace("+", "_"), f.meaning, args, values, definitions)


def _fields(system):
    states = system.states
    values = {m: tuple(system.divided(m.slow, m.fast).values()) for m in system.modes}
    args = _signature(system, states + sum(values.values(), ()))
    for mode in system.modes:
        yield Function(mode.name, f"{', '.join(f'd{s}/dt' for s in states)} in mode {mode.name}", args, values[mode])


def _manifolds(system, order):
    for m in _real_manifolds(system):
        y = ", ".join(map(str, m.branch))
        kind = f", the {m.stability} slow manifold" if isinstance(m.stability, str) else ""
        where = f"{y} on {m.name}{kind} of {m.mode}"
        where += f" by {y} on its branch" if is_implicit(m.branch) else ""
        one_sided = m.domain != sp.true and m.dynamics.where != system.mode(m.mode).where
        where += f", where {formula_in_words(m.domain)}" if one_sided else ""
        definitions, levels = _coefficients(m, system, order)
        values = tuple(sp.Add(*(c * m.small**k for k, c in enumerate(cs))) for cs in zip(*levels, strict=True))
        single = len(values) == 1
        if single:
            about = f"the coefficients of 1, {m.small}, .., {m.small}^{order} of {where}"
            yield _function(system, f"{m.name}_series", about, tuple(c for (c,) in levels), definitions)
        about = f"{where}, to order {order} in {m.small}"
        yield _function(system, m.name, about, values[0] if single else values, definitions)
        if m.closed is not None:
            yield _function(system, f"{m.name}_exact", f"{where}, exact while its root is real", m.closed)


def _coefficients(m, system, order):
    """Return (definitions, coefficients of 1, mu, ...); a coefficient is a tuple over the fast states.

    The definitions are the intermediate quantities of the straight-line code for long rates or coefficients, else ().
    """
    if not (_is_long(m.dynamics) or has_long_coefficients(m.dynamics, m.branch, order)):
        with suppress(NotDerivable):
            found = replace(m, order=order).coefficients
            return (), [tuple(c.values()) if isinstance(c, sp.Dict) else (c,) for c in found]
    mode, count = m.dynamics, len(m.branch)
    signs = {sp.Dummy("s"): quantity for quantity in mode.signed}
    one_sided = replace(mode, slow=one_side(mode.slow, signs), fast=one_side(mode.fast, signs))
    parameters = (*(p for p in system.parameters if p != m.small), *signs)
    definitions, found = formulas(one_sided, m.small, parameters).series(order)
    used = sp.Tuple(*(e for _, e in definitions)).free_symbols
    taken = [(s, sp.Abs(on := q.subs(m.branch)) / on) for s, q in signs.items() if s in used]
    taken += [(y, h) for y, h in m.branch.items() if y in used and y != h]
    return (*taken, *definitions), [found[k : k + count] for k in range(0, len(found), count)]


def _is_long(mode):
    """Tell whether the rates are long, so that coefficients are written as straight-line code."""
    return heavy(sp.Tuple(*mode.slow.values(), *mode.fast.values()))


def _real_manifolds(system):
    """Return the slow manifolds.

    Where the formula of a branch has Lambert's W, or long rates are nonlinear in the fast states, a single manifold
    stands for all branches of the mode; it is written in terms of the fast states on the branch.
    """
    try:
        found = slow_manifolds(system, order=0)
    except NotNormallyHyperbolic:
        return ()
    modes = dict.fromkeys(m.mode for m in found if sp.Tuple(*m.branch.values()).has(sp.LambertW) or _is_bent(m))
    implicit = (slow_manifold(system, order=0, mode=mode, name=f"Pi_{mode}") for mode in modes)
    return (*(m for m in found if m.mode not in modes), *implicit)


def _is_bent(m):
    """Tell whether the rates are long and nonlinear in the fast states, so that these are arguments of the code."""
    return _is_long(m.dynamics) and fast_jacobian(m.dynamics, m.small).has(*m.branch)


def _spectra(system):
    try:
        spectra = eigenvalues(system)
    except (NotDerivable, NotNormallyHyperbolic):
        return
    for s in (s for s in spectra if isinstance(s, Eigenvalues)):
        ratio = sp.cancel(system.small / s.coalescence)
        discriminant = sp.discriminant(s.polynomial, LAMBDA)
        meet = f"{ratio} <= 1" if ratio.is_polynomial(system.small) else f"{discriminant} >= 0"
        real = f"of {s.mode}; real while {meet}"
        yield _function(system, f"{s.mode}_slow_eigenvalue", f"the slow eigenvalue {real}", s.slow)
        yield _function(system, f"{s.mode}_fast_eigenvalue", f"the fast eigenvalue {real}", s.fast)


def _edges(system):
    try:
        edges = stick_regions(system).edges
    except NotDerivable:
        return
    if edges:
        load = formula_in_words(system.friction.load)
        about = f"the loads {load} at which stick can end; none where a denominator is 0"
        yield _function(system, "stick_edges", about, edges)


def _function(system, name, meaning, values, definitions=()):
    used = (*(values if isinstance(values, tuple) else (values,)), *(e for _, e in definitions))
    return Function(name, meaning, _signature(system, used, {t for t, _ in definitions}), values, definitions)


def _signature(system, values, defined=frozenset()):
    """Return the arguments of ``values`` in a fixed order: states, small parameter, other parameters by name."""
    used, states = sp.Tuple(*values).free_symbols - defined, system.states
    rest = sorted(used - {*states, system.small}, key=str)
    return (*(s for s in states if s in used), *({system.small} & used), *rest)


def _heading(system, name):
    """Return the equations as lines of text; above the equations of a mode stand its name and condition."""
    kind = "slow-fast system" if system.fast else "system"
    lines = [f"{name}: a {kind}, written by asympk {__version__}; needs nothing but a math library.", ""]
    for mode in system.modes:
        where = "" if mode.where == sp.true else f", where {formula_in_words(mode.where)}"
        lines.append(f"{mode.name}{where}:")
        lines += [f"    d{x}/dt = {formula_in_words(f)}" for x, f in mode.slow.items()]
        lines += [f"    {system.small} d{y}/dt = {formula_in_words(g)}" for y, g in mode.fast.items()]
    lines += ["", f"assumed: {formula_in_words(system.assumptions)}"] if system.assumptions != sp.true else []
    put = plain_names_of((*system.states, *system.parameters))
    aliases = [f"{plain} stands for {rate}" for rate, plain in put.items()]
    return [*lines, "", *aliases] if aliases else lines


def _python(name, heading, functions):
    """Return {file name: text} of a Python module that imports math and nothing else."""
    parts = ["\n".join(['r"""', *heading, '"""', ""])]
    for f in functions:
        head, body = _lowered(f, "math", f.name).source.split("\n", 1)
        parts.append(f'{head}\n    r"""Return {f.meaning}."""\n{body}')
    if any("math." in part for part in parts[1:]):
        parts[0] += "\nimport math\n"
    return {f"{name}.py": "\n\n".join(parts)}


def _c(name, heading, functions):
    """Return {file name: text} of a C99 header and source; every function is called ``name_function``.

    The source does not compile with the header of another export, which an interruption between the two leaves.
    """
    comment = "\n".join(["/*", *(f" * {line}".rstrip() for line in heading), " */", ""])
    functions = [(f, _lowered(f, "c", f"{name}_{f.name}")) for f in functions]
    prototypes = [f"/* {f.meaning} */\n{text.partition(chr(10))[0]};\n" for f, text in functions]
    guard, bodies = f"{name.upper()}_H", [text for _, text in functions]
    mark = f"{guard}_{sha256(''.join([comment, *bodies]).encode()).hexdigest()[:16].upper()}"
    header = [
        comment,
        f"#ifndef {guard}\n#define {guard}\n#define {mark}\n",
        '#ifdef __cplusplus\nextern "C" {\n#endif\n',
        *prototypes,
        "#ifdef __cplusplus\n}\n#endif\n",
        "#endif\n",
    ]
    matched = f'#ifndef {mark}\n#error "{name}.h is of another export; write both again"\n#endif\n'
    source = [comment, f'#include <math.h>\n\n#include "{name}.h"\n', matched, *bodies]
    return {f"{name}.h": "\n".join(header), f"{name}.c": "\n".join(source)}


def _lowered(f, target, name):
    return lower(f.args, f.values, target, name=name, branching=True, definitions=f.definitions)


_WRITERS = {"c": _c, "python": _python}
