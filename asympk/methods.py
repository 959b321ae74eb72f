"""The doors to every model: ``solve`` and ``solve_many`` look the method up and load its module only then."""

from functools import cache
from importlib import import_module
from typing import Any

from asympk.errors import InputError, UnknownName
from asympk.naming import named
from asympk.numbers import short
from asympk.path import Path
from asympk.scene import Scene, require_scene

# method -> module of asympk that has ``run(scene, method, **options) -> Path``
METHODS = {
    "exact": "flow.exact",
    "rigid": "asymptotics.models",
    "slow": "asymptotics.models",
    "jump": "asymptotics.models",
    "rk45": "integrators.integrate",
    "dop853": "integrators.integrate",
    "radau": "integrators.integrate",
    "bdf": "integrators.integrate",
    "lsoda": "integrators.integrate",
    "heyoka": "integrators.integrate",
    "cvode": "integrators.integrate",
    "kvaerno5": "integrators.integrate",
    "sign": "integrators.sign",
    "tanh": "integrators.tanh",
    "moreau": "integrators.moreau",
}
# the same for the scene of a system without a kernel of its own
FOR_SYSTEMS = {
    name: module for name, module in METHODS.items() if module.startswith("integrators") and name != "moreau"
} | {"exact": "integrators.stepped", "slow": "asymptotics.general", "jump": "asymptotics.general"}
# method -> module of asympk that has ``solve_many(sigma, mu, x, y, z, until, sigma0, method, **options)``
FOR_ARRAYS = {
    "exact": "arrays.ensemble",
    "rigid": "asymptotics.finals",
    "slow": "asymptotics.finals",
    "jump": "asymptotics.finals",
}


def solve(scene: Scene, method: str = "exact", **options: Any) -> Path:
    """Follow ``scene`` from its start to ``until`` and return a ``Path``.

    ``method="exact"`` is the event-driven closed form of the rod; for the scene of a system without a closed form it
    is a stiff integrator of small tolerance, and ``path.model`` tells. ``digits=n`` runs either on mpmath numbers.
    Options belong to the method. Raises ``UnknownName`` for a method that does not exist, ``InputError`` for an option
    it does not have and for what is no ``Scene``.
    """
    require_scene(scene, "solve")
    name = named("method", method, METHODS)
    if scene.system is None:
        return _run(METHODS, name, scene, options)
    if inside := _found("systems.kernels", "kernel_scene")(scene):
        return _found("systems.kernels", "named")(_run(METHODS, name, inside, options), scene)
    if name not in FOR_SYSTEMS:
        raise InputError(f"method {name!r} follows the Painlevé-Klein rod alone; for a system choose one of "
                         f"{', '.join(FOR_SYSTEMS)}")  # fmt: skip
    if name == "exact" and _found("affine.run", "affine")(scene.system):
        return _run({name: "affine.run"}, name, scene, options)
    return _run(FOR_SYSTEMS, name, scene, options)


def _run(registry: dict[str, str], method: str, scene: Any, options: dict[str, Any]) -> Path:
    run = _found(registry[method], "run")
    if options:
        _require_known(method, run, options)
    return run(scene, method, **options)


def solve_many(
    sigma: Any = None, mu: Any = None, x: Any = None, y: Any = None, z: Any = None, until: Any = None,
    sigma0: Any = None, method: str = "exact", *, system: Any = None, values: Any = None, start: Any = None,
    **options: Any,
) -> Any:  # fmt: skip
    """Follow trajectories from (x, y, z) to ``until``; all arguments broadcast. Results equal those of ``solve``.

    ``method="exact"`` returns an ``Ensemble``: ``final`` (3, ...), ``n_events``, ``events()``, and ``outcome`` where
    a trajectory cannot be followed to its end. Its options are ``events=True``, to keep the events,
    ``strict=True``, to raise instead, and ``progress(done, total)``, called after each chunk. The models ``"jump"``,
    ``"slow"`` and ``"rigid"`` take ``order=n`` and return ``Finals``: ``final``, the relative ``error`` to expect, and,
    where a model refuses and both are inf, ``reason``, an index of ``reasons``. With ``system`` an affine ``System`` is
    followed, ``values`` and ``start`` mapping its parameters and states, by symbol or by name, to numbers or arrays;
    ``final`` is (n, ...) then. Raises ``UnknownName``, ``InputError``; strict ones also ``TooManyEvents``, ``TooLarge``
    and ``Undecided``, the models ``OrderError``.
    """
    method = named("method", method, METHODS)
    if system is not None:
        if any(given is not None for given in (sigma, mu, x, y, z, sigma0)) or method != "exact":
            raise InputError("sigma, mu, x, y, z, sigma0 and method belong to the rod; a system has values= and start=")
        return _found("affine.many", "solve_many")(
            system=system, values={} if values is None else values, start=start, until=until, **options
        )
    if method not in FOR_ARRAYS:
        raise UnknownName(f"method {short(method)} does not follow arrays; choose one of {', '.join(FOR_ARRAYS)}, "
                          "or solve scene by scene")  # fmt: skip
    given = {"sigma": sigma, "mu": mu, "x": x, "y": y, "z": z, "until": until}
    if missing := [name for name, value in given.items() if value is None]:
        raise InputError(f"{', '.join(missing)} = None: give numbers or arrays, or system=, values=, start=, until=")
    run = _found(FOR_ARRAYS[method], "solve_many")
    if options:
        _require_known(method, run, options)
    return run(sigma, mu, x, y, z, until, sigma0, method, **options)


@cache
def _found(module: str, name: str) -> Any:
    return getattr(import_module(f"asympk.{module}"), name)


def _require_known(method: str, run: Any, options: dict[str, Any]) -> None:
    from inspect import Parameter, signature

    known = [name for name, option in signature(run).parameters.items() if option.kind is Parameter.KEYWORD_ONLY]
    unknown = [name for name in options if name not in known]
    if unknown:
        raise InputError(f"method {method!r} has no option {unknown[0]!r}; it has {', '.join(known)}")
