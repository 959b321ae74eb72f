"""The errors of asympk: one class per kind, each also a subclass of the builtin error that a caller would expect.

A message is one line and says what was found, where, and what to do.
"""

from typing import Any


class AsympkError(Exception):
    """Any error that asympk raises on purpose; ``t``, ``state`` are where a run ended, None where that is not known."""

    def __init__(self, message: str = "", t: Any = None, state: Any = None):
        super().__init__(message)
        self.t, self.state = t, state


class InputError(AsympkError, ValueError):
    """An argument has a wrong type or is out of its range."""


class UnknownName(AsympkError, LookupError):
    """A name (claim, manifold, method, scene, key) is not one of those that exist."""


class MissingPackage(AsympkError, ImportError):
    """An optional package is not installed; the message gives the pip line."""


class OrderError(AsympkError, ValueError):
    """An expansion is asked for beyond the order to which it is known."""


class BranchError(AsympkError, ValueError):
    """A proposed branch does not solve the critical equation g(x, y, 0) = 0."""


class NotNormallyHyperbolic(AsympkError, ArithmeticError):
    """The fast Jacobian dg/dy is singular on the branch: no slow manifold continues it."""


class NoManifold(AsympkError, ArithmeticError):
    """A slow manifold does not exist for these parameters."""


class Stopped(AsympkError, ArithmeticError):
    """The motion of the model ends at the point ``t``, ``state``."""


class NoMotion(Stopped):
    """No mode is consistent: the model (a rigid one, as a rule) has no motion from this state."""


class TwoMotions(Stopped):
    """Several modes are consistent: the model (a rigid one, as a rule) has two motions from this state."""


class OutOfRange(AsympkError, ArithmeticError):
    """An asymptotic prediction is asked for where its expansion does not hold."""


class NegativeFriction(OutOfRange):
    """Kinetic friction is negative at a state of the motion: it would push on."""


class Pole(Stopped, OutOfRange):
    """The motion has passed a pole of its rates before the time ``t``."""


class TooManyEvents(AsympkError, RuntimeError):
    """A trajectory has more events than allowed; ``t``, ``state`` are those of the last one."""


class TooLarge(AsympkError, OverflowError):
    """A state or an intermediate quantity leaves the range of the numbers in use."""


class Undecided(AsympkError, ArithmeticError):
    """A sign that decides the sequence of events is within the rounding errors: only more digits can decide it."""


class NotDerivable(AsympkError, ValueError):
    """A derivation is not possible for the given model."""


class WorkersLost(AsympkError, RuntimeError):
    """Worker processes die again and again without finishing any work."""


class Accumulation(AsympkError, RuntimeError):
    """Events accumulate: no run passes infinitely many; ``t``, ``state`` are those of the last one that was found."""


class UnboundedReaction(Stopped):
    """The reaction of a contact grows beyond all bounds, or is not determined: the rigid model ends there."""


class Unfinished(AsympkError, RuntimeError):
    """A run did not reach its end; ``path`` is the part that was followed, and ``path.info`` says why it stopped."""

    def __init__(self, message: str, path: Any = None):
        super().__init__(message)
        self.path = path
