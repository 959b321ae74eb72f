"""The door to every model: ``solve(scene, method=...)`` looks the method up and loads its module only then."""

from functools import cache
from importlib import import_module

from asympk.errors import InputError, UnknownName

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


def solve(scene, method="exact", **options):
    """Follow ``scene`` from its start to ``until`` and return a ``Path``.

    ``method="exact"`` is the event-driven closed form; ``digits=n`` runs it on mpmath numbers. Options belong to
    the method. Raises ``UnknownName`` for a method that does not exist, ``InputError`` for an option it does not have.
    """
    if method not in METHODS:
        raise UnknownName(f"method {method!r} is unknown; choose one of {', '.join(METHODS)}")
    run = _runner(METHODS[method])
    if options:
        _require_known(method, run, options)
    return run(scene, method, **options)


@cache
def _runner(module):
    return import_module(f"asympk.{module}").run


def _require_known(method, run, options):
    from inspect import Parameter, signature

    known = [name for name, option in signature(run).parameters.items() if option.kind is Parameter.KEYWORD_ONLY]
    unknown = [name for name in options if name not in known]
    if unknown:
        raise InputError(f"method {method!r} has no option {unknown[0]!r}; it has {', '.join(known)}")
