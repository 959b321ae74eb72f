"""The doors to every model: ``solve`` and ``solve_many`` look the method up and load its module only then."""

from functools import cache
from importlib import import_module

from asympk.errors import InputError, UnknownName
from asympk.numbers import short

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
# method -> module of asympk that has ``solve_many(sigma, mu, x, y, z, until, sigma0, method, **options)``
FOR_ARRAYS = {
    "exact": "arrays.ensemble",
    "rigid": "asymptotics.finals",
    "slow": "asymptotics.finals",
    "jump": "asymptotics.finals",
}


def solve(scene, method="exact", **options):
    """Follow ``scene`` from its start to ``until`` and return a ``Path``.

    ``method="exact"`` is the event-driven closed form; ``digits=n`` runs it on mpmath numbers. Options belong to
    the method. Raises ``UnknownName`` for a method that does not exist, ``InputError`` for an option it does not have.
    """
    if not isinstance(method, str) or method not in METHODS:
        raise UnknownName(f"method {short(method)} is unknown; choose one of {', '.join(METHODS)}")
    run = _found(METHODS[method], "run")
    if options:
        _require_known(method, run, options)
    return run(scene, method, **options)


def solve_many(sigma, mu, x, y, z, until, sigma0=None, method="exact", **options):
    """Follow trajectories from (x, y, z) to ``until``; all arguments broadcast. Results equal those of ``solve``.

    ``method="exact"`` returns an ``Ensemble`` with ``final`` (3, ...), ``n_events`` and ``events()``; its options are
    ``events=True``, to keep the events, and ``progress(done, total)``, called after each chunk. The models ``"jump"``,
    ``"slow"`` and ``"rigid"`` take ``order=n`` and return ``Finals``: ``final``, the relative ``error`` to expect, and,
    where a model refuses and both are inf, ``reason``, an index of ``reasons``. Raises ``UnknownName``, ``InputError``;
    ``"exact"`` also ``TooManyEvents`` and ``TooLarge``, the models ``OrderError``.
    """
    if not isinstance(method, str) or method not in FOR_ARRAYS:
        raise UnknownName(f"method {short(method)} does not follow arrays; choose one of {', '.join(FOR_ARRAYS)}, "
                          "or solve scene by scene")  # fmt: skip
    run = _found(FOR_ARRAYS[method], "solve_many")
    if options:
        _require_known(method, run, options)
    return run(sigma, mu, x, y, z, until, sigma0, method, **options)


@cache
def _found(module, name):
    return getattr(import_module(f"asympk.{module}"), name)


def _require_known(method, run, options):
    from inspect import Parameter, signature

    known = [name for name, option in signature(run).parameters.items() if option.kind is Parameter.KEYWORD_ONLY]
    unknown = [name for name in options if name not in known]
    if unknown:
        raise InputError(f"method {method!r} has no option {unknown[0]!r}; it has {', '.join(known)}")
