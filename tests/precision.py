"""What is done to mpmath's own precision while a test computes."""

from collections.abc import Iterator
from contextlib import contextmanager

import mpmath
import pytest
from mpmath.ctx_mp_python import PythonMPContext


@contextmanager
def precisions_set() -> Iterator[list]:
    """Yield a list of what the precision of the module ``mpmath`` is set to meanwhile."""
    found = []
    with pytest.MonkeyPatch.context() as patch:
        for name in ("prec", "dps"):
            kept = getattr(PythonMPContext, name)

            def put(context, value, kept=kept):
                if context is mpmath.mp:
                    found.append(value)
                kept.fset(context, value)

            patch.setattr(PythonMPContext, name, property(kept.fget, put))
        yield found
