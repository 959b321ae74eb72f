r"""The equations of a mechanism in the two directions of its contact.

    g''     = a_N + G_NN R + G_NT F
    gamma'  = a_T + G_NT R + G_TT F,        G = W' M^-1 W,   W = (W_N, W_T)

g is the gap, gamma the sliding velocity, R the reaction that opens the gap, F the friction force along gamma. The
free accelerations a_N, a_T contain every term without R and F: applied forces, centrifugal terms, and the motion of the
guide. ``Kinetics.delassus`` is G and ``Kinetics.free`` is (a_N, a_T). Both are computed from cofactors of M, or, where
these are ``long``, left as forms through the inverse of M, which are computed in numbers only.

While joints, contacts without friction, hold their gaps, M is bordered once by the gradients C of these, (M, C'; C, 0),
and Q by accelerations that keep them: G and the free accelerations are then those with all joints held.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import sympy as sp

from asympk.errors import NotDerivable
from asympk.symbolic.derivatives import slope_by
from asympk.symbolic.inverses import InverseForm
from asympk.symbolic.long import atoms, has_no_inverse, is_longer, replaced, symbols_in
from asympk.symbolic.penetration import RootSlope
from asympk.symbolic.reading import unused_symbol
from asympk.symbolic.tidy import (
    cofactors,
    collected,
    contracted,
    expanded_adjugate,
    expanded_determinant,
    has_long_minors,
    in_sums_of_angles,
    tidy,
)


@dataclass(frozen=True)
class Kinetics:
    """A mechanism with one contact in plain symbols; ``slip`` is the sliding velocity gamma itself.

    Meanwhile ``joints`` are held without friction. ``rough`` contacts, which also hold both ways, enter the
    ``determinants`` alone.
    """

    coordinates: tuple[sp.Symbol, ...]
    velocities: tuple[sp.Symbol, ...]
    mass: sp.ImmutableMatrix = field(repr=False)
    forces: sp.ImmutableMatrix = field(repr=False)
    gap: sp.Expr
    slip: sp.Expr
    friction: sp.Expr
    static: sp.Expr
    load: sp.Expr
    unilateral: bool
    time: sp.Symbol
    joints: tuple["Kinetics", ...] = field(default=(), repr=False)
    rough: tuple["Kinetics", ...] = field(default=(), repr=False)

    @cached_property
    def directions(self) -> sp.ImmutableMatrix:
        """The rows W_N = dg/dq and W_T = d gamma/dq' as a 2 x n matrix.

        Sums of angles are contracted if the mass matrix would be ``long`` by the rows alone, as by those of an incline.
        """
        gap = [slope_in_powers(self.gap, q) for q in self.coordinates]
        slip = [slope_in_powers(self.slip, u) for u in self.velocities]
        rows = sp.ImmutableMatrix([gap, slip])
        by_rows = has_long_minors(_bordered(self.mass, rows)) and not has_long_minors(self.mass)
        return rows.applyfunc(in_sums_of_angles) if by_rows else rows

    @cached_property
    def response(self) -> sp.ImmutableMatrix:
        """M^-1 (W_N, W_T, Q), n x 3: the accelerations by a unit reaction, a unit friction force and the forces."""
        right, n = sp.Matrix.hstack(self._rows.T, self._right), len(self.coordinates)
        if self.long:
            return sp.ImmutableMatrix(n, 3, lambda k, j: _row_of_inverse(self._collected, k, right[:, j]))
        adjugate = expanded_adjugate(self._held) if self.joints else self.mass.adjugate()
        found = (-1) ** len(self.joints) * adjugate[:n, :] * right
        return found.applyfunc(lambda part: tidy(part / self._inertia)).as_immutable()

    @cached_property
    def delassus(self) -> sp.ImmutableMatrix:
        """The Delassus matrix G = W' M^-1 W."""
        normal, mixed, tangential = (self._through_mass(*pair) for pair in ((0, 0), (0, 1), (1, 1)))
        return sp.ImmutableMatrix([[normal, mixed], [mixed, tangential]])

    def coupling(self, other: "Kinetics") -> sp.ImmutableMatrix:
        """Return W' M^-1 V for the directions V of another contact of the same mechanism; that with itself is G."""
        if other is self:
            return self.delassus
        if self.long:
            form = lambda i, j: InverseForm.of(self.directions[i, :], self._collected, other.directions[j, :])  # noqa: E731
            return sp.ImmutableMatrix(2, 2, form)
        return (self.directions * other.response[:, :2]).applyfunc(tidy).as_immutable()

    def _through_mass(self, i: int, j: int) -> sp.Expr:
        if self.long:
            return InverseForm.of(self._rows[i, :], self._collected, self._rows[j, :])
        return tidy(self.undivided[i, j] / self._inertia)

    @cached_property
    def _collected(self) -> sp.ImmutableMatrix:
        """M, bordered, with products that occur in several terms of an entry, as of the links of a chain, once."""
        return self._held.applyfunc(collected)

    @cached_property
    def undivided(self) -> sp.Matrix:
        """G times ``_inertia``, without fractions where M, gap and slip have none."""
        normal, mixed, tangential = (self._across([self.directions[i, :]], [self.directions[j, :]])
                                     for i, j in ((0, 0), (0, 1), (1, 1)))
        return sp.Matrix([[normal, mixed], [mixed, tangential]])

    def determinants(self, signs: Sequence[int]) -> tuple[sp.Expr, sp.Expr, sp.Expr]:
        """Return D_0, D_1 and D_2 of slip in which the ``rough`` contacts have the friction -sign f nu R.

        D_0 - sign f nu D_1 is the determinant of all g'' by all reactions, and D_2 that of the rough contacts alone,
        each times a positive number. ``signs`` are those of sliding velocity times reaction.
        """
        normals = [self.directions[0, :], *(contact.even * contact.directions[0, :] for contact in self.rough)]
        bounds = (sign * contact.friction * contact.load for sign, contact in zip(signs, self.rough, strict=True))
        pushes = [contact.even * (contact.directions[0, :] - bound * contact.directions[1, :])
                  for contact, bound in zip(self.rough, bounds, strict=True)]
        whole = (self._across(normals, [self.directions[k, :], *pushes]) for k in (0, 1))
        return *whole, self._across(normals[1:], pushes)

    def _across(self, rows: Sequence[sp.Matrix], pushes: Sequence[sp.Matrix]) -> sp.Expr:
        """Return det (V' M^-1 P) of the rows V and P, with all joints held, times a positive number."""
        across, along = (self._wide(sp.Matrix.vstack(*part)) for part in (rows, pushes))
        if self.long:
            form = lambda i, j: InverseForm.of(across[i, :], self._collected, along[j, :])  # noqa: E731
            return sp.Matrix(len(rows), len(rows), form).det(method="berkowitz")
        border = sp.Matrix(sp.BlockMatrix([[self._held, along.T], [across, sp.zeros(len(rows))]]))
        return (-1) ** (len(rows) + len(self.joints)) * expanded_determinant(border)

    @cached_property
    def gap_rate(self) -> sp.Expr:
        """g' as an expression in coordinates and velocities."""
        return self.rate(self.gap)

    @cached_property
    def free(self) -> tuple[sp.Expr, sp.Expr]:
        """The free accelerations (a_N, a_T): g'' and gamma' without reaction and friction."""
        if self.long:
            rows = (InverseForm.of(self._rows[k, :], self._collected, self._right) for k in (0, 1))
            return tuple(row + self.rate(expr) for row, expr in zip(rows, (self.gap_rate, self.slip), strict=True))
        accelerations = dict(zip(self.velocities, self.response[:, 2], strict=True))
        return tuple(_short(self.rate(expr, accelerations)) for expr in (self.gap_rate, self.slip))

    @cached_property
    def determinant(self) -> sp.Expr:
        """D = G_NN G_TT - G_NT^2, positive where slip and gap are independent, as det (M, W; W', 0) / det M.

        The bordered matrix has no fractions. Products of entries of G are long, and SymPy may expand them without end.
        """
        if self.long:
            return self.delassus[0, 0] * self.delassus[1, 1] - self.delassus[0, 1] ** 2
        return tidy(tidy((-1) ** len(self.joints) * expanded_determinant(self._border)) / self._inertia)

    @cached_property
    def gap_impact(self) -> sp.ImmutableMatrix:
        """(dq', -P_N, -P_T) of an impact in which g' gains 1 and gamma nothing: M dq' = W' P, W dq' = (1, 0).

        Before -P_N stand those of the joints, over their ``even``.
        """
        return self._impact(-2)

    @cached_property
    def slip_impact(self) -> sp.ImmutableMatrix:
        """(dq', -P_N, -P_T) of an impact in which gamma gains 1 and g' nothing: M dq' = W' P, W dq' = (0, 1)."""
        return self._impact(-1)

    def _impact(self, column: int) -> sp.ImmutableMatrix:
        border, n = self._border, self._border.rows
        if self.long:
            right = sp.eye(n)[:, column]
            return sp.ImmutableMatrix(n, 1, lambda k, _: _row_of_inverse(border, k, right))
        adjugate, determinant = self._cofactors
        return adjugate[:, column].applyfunc(lambda part: contracted(part / determinant)).as_immutable()

    @cached_property
    def _cofactors(self) -> tuple[sp.Matrix, sp.Expr]:
        return cofactors(self._border)

    @cached_property
    def _border(self) -> sp.Matrix:
        return _bordered(self._held, self._rows)

    @cached_property
    def _held(self) -> sp.Matrix:
        """M, bordered by the gradients of the gaps that the joints hold, without denominators."""
        gradients = [joint.even * joint.directions[0, :] for joint in self.joints]
        return _bordered(self.mass, sp.Matrix.vstack(*gradients)) if gradients else self.mass

    @cached_property
    def even(self) -> sp.Expr:
        """The common denominator of the gradient of the gap, as a length has one: formulas are shorter without it."""
        return sp.fraction(sp.together(sp.Add(*(sp.Dummy() * part for part in self.directions[0, :]))))[1]

    @cached_property
    def _rows(self) -> sp.Matrix:
        return self._wide(self.directions)

    def _wide(self, rows: sp.Matrix) -> sp.Matrix:
        """Return rows for the bordered mass matrix."""
        return sp.Matrix.hstack(rows, sp.zeros(rows.rows, len(self.joints)))

    @cached_property
    def _right(self) -> sp.Matrix:
        """The forces, and the accelerations that keep the gaps of the joints."""
        return sp.Matrix([*self.forces, *(-joint.even * joint.rate(joint.gap_rate) for joint in self.joints)])

    @cached_property
    def _inertia(self) -> sp.Expr:
        """det M, with a border of joints up to its sign, which makes it positive."""
        return tidy((-1) ** len(self.joints) * expanded_determinant(self._held))

    def require_motion(self, others: Sequence["Kinetics"]) -> None:
        """Raise ``NotDerivable`` if gap and slip cannot move freely while ``others`` hold, or if these depend."""
        gaps = [contact.directions[0, :] for contact in others]
        if others and has_no_inverse(_bordered(self.mass, sp.Matrix.vstack(*gaps, self.directions))):
            raise NotDerivable("the others that hold both ways leave gap and slip no motions of their own, or depend "
                               "on each other: leave out what the rest holds, or take rigid()")

    @cached_property
    def long(self) -> bool:
        """Whether the mass matrix is not inverted in symbols: det M or D det M is too long for a formula."""
        return has_long_minors(self._held) or has_long_minors(self._border)

    def tidy_if_short(self, expr: sp.Expr) -> sp.Expr:
        """Return ``tidy(expr)``; if the mass matrix is ``long``, no formula of the mechanism will be read: ``expr``."""
        return expr if self.long else tidy(expr)

    def rate(self, expr: sp.Expr, accelerations: dict[sp.Symbol, sp.Expr] | None = None) -> sp.Expr:
        """Return d expr / dt; ``accelerations`` gives u' for every velocity in ``expr``, 0 where it is missing."""
        moved = zip(self.coordinates, self.velocities, strict=True)
        terms = [slope_in_powers(expr, q) * u for q, u in moved]
        terms += [slope_in_powers(expr, u) * rate for u, rate in (accelerations or {}).items()]
        return sp.Add(*terms, slope_in_powers(expr, self.time))

    def unused_symbol(self, name: str, *others: sp.Symbol, **assumptions: bool) -> sp.Symbol:
        """Return a Symbol ``name``, with underscores if the mechanism or ``others`` have a symbol of this name."""
        return unused_symbol(name, (*self.symbols, *others), **assumptions)

    @property
    def symbols(self) -> tuple[sp.Symbol, ...]:
        """Every symbol: coordinates, velocities, parameters, the time."""
        return (*self.coordinates, *self.velocities, *self.parameters, self.time)

    @property
    def parameters(self) -> tuple[sp.Symbol, ...]:
        """Every symbol that is neither a coordinate, nor a velocity, nor the time, sorted by name."""
        return tuple(sorted(self._used - {*self.coordinates, *self.velocities, self.time}, key=str))

    @property
    def timed(self) -> bool:
        """Whether forces or contact depend on the time."""
        return self.time in self._used

    @cached_property
    def _used(self) -> set[sp.Basic]:
        parts = (*self.mass, *self.forces, self.gap, self.slip, self.friction, self.static, self.load)
        return symbols_in(sp.Tuple(*parts)).union(*(other._used for other in (*self.joints, *self.rough)))


def _bordered(mass: sp.Matrix, rows: sp.Matrix) -> sp.Matrix:
    return sp.Matrix(sp.BlockMatrix([[mass, rows.T], [rows, sp.zeros(rows.rows)]]))


def slope_in_powers(expr: sp.Expr, s: sp.Symbol) -> sp.Expr:
    """Return the derivative of ``expr`` by ``s`` between jumps, with its roots written as powers."""
    slope = slope_by(expr, s)
    while rooted := atoms(slope, RootSlope):
        slope = replaced(slope, {root: root.args[0] * root.args[1] ** root.args[2] for root in rooted})
    return slope


def _short(total: sp.Expr) -> sp.Expr:
    """Tidy a sum of tidy terms; a long sum is kept, as a common denominator shortens it little and costs seconds."""
    return total if is_longer(total, 60) else tidy(total)


def _row_of_inverse(matrix: sp.Matrix, k: int, right: sp.Matrix) -> sp.Expr:
    """Return row k of the inverse of a symmetric matrix, times the column ``right``."""
    return InverseForm.of(sp.eye(matrix.rows)[k, :], matrix, right)
