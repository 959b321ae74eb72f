"""``solve`` and ``solve_many``: they look up a method in a table and load the module that follows it only then.

``METHODS`` is the table for any system; the Painlevé-Klein rod has a faster kernel, ``asympk.systems.kernels``.
"""

from dataclasses import replace
from functools import cache
from importlib import import_module
from typing import Any

from asympk.errors import InputError, UnknownName
from asympk.naming import named
from asympk.numbers import flag, require_callback, short
from asympk.path import Path
from asympk.scene import Scene, require_scene
from asympk.systems.kernels import FOR_ARRAYS, FOR_SCENES, kernel_scene

# method -> module of asympk with ``run(scene, method, **options) -> Path`` for a scene of any system, or
# module:function; "" where only the kernel of the rod has the method
METHODS = {
    "exact": "integrators.stepped",
    "rigid": "",
    **dict.fromkeys(("slow", "jump"), "asymptotics.general"),
    **dict.fromkeys(("rk45", "dop853", "radau", "bdf", "lsoda"), "integrators.integrate"),
    **dict.fromkeys(("heyoka", "cvode", "kvaerno5"), "integrators.integrate"),
    "sign": "integrators.onefield:sign",
    "tanh": "integrators.onefield:tanh",
    "moreau": "",
}


def solve(scene: Scene, method: str = "exact", **options: Any) -> Path:
    """Follow ``scene`` from its start to ``until`` and return a ``Path``.

    ``method="exact"`` is the event-driven closed form for the rod and for every system whose modes are all affine, on
    each side of its switching surfaces. For other systems ``"exact"`` is a stiff integrator whose steps have errors of
    about 1e-10, or 1e-12 where errors grow; ``path.model`` then names the integrator, and ``path.info["why"]`` says
    what is not affine. With ``digits=n`` the run is computed in mpmath numbers. Options belong to the method. Raises
    ``UnknownName`` for an unknown method, and ``InputError`` for an option that the method does not have or if
    ``scene`` is no ``Scene``.
    """
    require_scene(scene, "solve")
    name = named("method", method, METHODS)
    if inside := kernel_scene(scene):
        path = _run(FOR_SCENES.get(name) or METHODS[name], name, inside, options)
        return path if path.scene is scene else replace(path, scene=scene)
    if not METHODS[name]:
        limit = "; the rigid limit is method 'slow' with order = 0" if name == "rigid" else ""
        raise InputError(f"method {name!r} follows the Painlevé-Klein rod alone; for a system choose one of "
                         f"{', '.join(n for n, module in METHODS.items() if module)}{limit}")
    if name != "exact":
        return _run(METHODS[name], name, scene, options)
    if reason := _found("affine.run", "scene_obstacle")(scene):
        path = _run(METHODS[name], name, scene, options)
        return replace(path, info={**path.info, "why": reason})
    return _run("affine.run", name, scene, options)


def _run(module: str, method: str, scene: Any, options: dict[str, Any]) -> Path:
    home, _, name = module.partition(":")
    run = _found(home, name or "run")
    if options:
        _require_known(method, run, options)
    return run(scene, method, **options)


def solve_many(
    sigma: Any = None, mu: Any = None, x: Any = None, y: Any = None, z: Any = None, until: Any = None,
    sigma0: Any = None, method: str = "exact", *, system: Any = None, values: Any = None, start: Any = None,
    **options: Any,
) -> Any:
    """Follow trajectories from (x, y, z) to ``until``; all arguments broadcast. Results equal those of ``solve``.

    ``method="exact"`` returns a ``RodEnsemble`` with ``final`` (3, ...), ``n_events``, ``events()`` and ``outcome``,
    which says why a trajectory could not be followed to its end. The options are ``events=True`` to keep the events,
    ``strict=True`` to raise an error for such a trajectory, and ``progress(done, total)``, called after each chunk.
    The models ``"jump"``, ``"slow"`` and ``"rigid"`` take ``order=n`` and return ``FinalStates``: ``final``, the
    expected relative ``error``, and ``reason``, an index of ``reasons``, where a model refuses and ``final`` and
    ``error`` are inf.

    With ``system``, an affine ``System`` is followed. ``values`` and ``start`` map its parameters and states, by symbol
    or by name, to numbers or arrays. Then ``final`` is (n, ...), and the options are ``strict`` and ``progress``.
    Raises ``UnknownName`` and ``InputError``, with ``strict`` also the errors of ``solve``, for a model ``OrderError``.
    """
    method = named("method", method, METHODS)
    require_rod_or_system((sigma, mu, x, y, z, sigma0, None if method == "exact" else method), system, values, start)
    if system is not None:
        run = _found("affine.many", "solve_many")
        _require_known(method, run, options)
        return run(system=system, values={} if values is None else values, start=start, until=until, **options)
    if method not in FOR_ARRAYS:
        raise UnknownName(f"method {short(method)} does not follow arrays; choose one of {', '.join(FOR_ARRAYS)}, "
                          "or solve scene by scene")
    given = {"sigma": sigma, "mu": mu, "x": x, "y": y, "z": z, "until": until}
    if missing := [name for name, value in given.items() if value is None]:
        raise InputError(f"{', '.join(missing)} = None: give numbers or arrays, or system=, values=, start=, until=")
    run = _found(FOR_ARRAYS[method], "solve_many")
    _require_known(method, run, options)
    return run(sigma, mu, x, y, z, until, sigma0, method, **options)


def require_rod_or_system(of_rod: tuple, system: Any, values: Any, start: Any) -> None:
    """Raise ``InputError`` for arguments ``of_rod`` beside a system, and for ``values`` or ``start`` without one."""
    if system is not None and any(given is not None for given in of_rod):
        raise InputError("sigma, mu, x, y, z, sigma0 and method belong to the rod; a system has values= and start=")
    if system is None and not (values is None and start is None):
        raise InputError("values and start are those of a system; give system=, or sigma, mu, x, y, z of the rod")


@cache
def _found(module: str, name: str) -> Any:
    return getattr(import_module(f"asympk.{module}"), name)


def _require_known(method: str, run: Any, options: dict[str, Any]) -> None:
    known = _options(run)
    for name, value in options.items():
        if name not in known:
            shown = (f"{name} (in Python)" if "Callable" in str(kind) else name for name, kind in known.items())
            raise InputError(f"method {method!r} has no option {name!r}; it has {', '.join(shown)}")
        if known[name] is bool:
            flag(name, value)
        if "Callable" in str(known[name]):
            require_callback(name, value)


@cache
def _options(run: Any) -> dict[str, Any]:
    """Return the annotations of the options of ``run``, by name."""
    from inspect import Parameter, signature

    found = signature(run).parameters.items()
    return {name: option.annotation for name, option in found if option.kind is Parameter.KEYWORD_ONLY}
