"""Methods to parametrise over, those of peers that are not installed marked to be skipped."""

import pytest

from asympk.integrators.integrate import absent

COMPILED = ("kvaerno5",)  # anew for every mode, which takes seconds


def here(*methods):
    """Parametrise over methods, skipping those whose package is not installed; those that are compiled are slow."""
    lacking, reason = absent(), "the extra 'peers' is not installed"
    return [pytest.param(m, marks=[pytest.mark.skipif(m in lacking, reason=f"{m}: {reason}"),
                                   *[pytest.mark.slow] * (m in COMPILED)]) for m in methods]
