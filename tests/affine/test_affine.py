"""The flow of one affine mode: exact in any dimension, whatever its spectrum, and no event missed."""

from fractions import Fraction

import mpmath
import numpy as np
import pytest

from asympk.affine import exponential
from asympk.affine.eigenpairs import eigenpairs
from asympk.affine.exponential import of_roots
from asympk.affine.functions import Arrays, Block, areas, functions, rounding_sizes, sizes
from asympk.affine.mode import AffineMode, ClosedSegment, in_digits
from asympk.affine.polynomial import _square_free, eigenvalue_polynomial, in_whole_numbers, resolvent
from asympk.arithmetic import Doubles, flow_context, set_digits
from asympk.errors import InputError, TooLarge, Undecided


def digits(n):
    m = flow_context(400)
    set_digits(m, n)
    return m


def truth(mode, start, t, dps=70):
    """Return the state at t by Taylor's series of the matrix exponential, with digits to spare."""
    mp = mpmath.mp
    with mp.workdps(dps + 40):
        rows = [[mp.mpf(v.numerator) / v.denominator for v in row] for row in mode.homogeneous]
        start = mp.matrix([mp.mpf(Fraction(v).numerator) / Fraction(v).denominator for v in start] + [1])
        return list(mp.expm(mp.matrix(rows) * mp.mpf(t), method="taylor") * start)[:-1]


def off(mode, start, t, found, dps=70):
    """Return the error of a state at t, relative to the largest state there and at the start."""
    true = truth(mode, start, t, dps)
    with mpmath.mp.workdps(dps + 40):
        size = max(max(map(abs, true)), max(map(abs, start)))
        return max(abs(a - mpmath.mp.mpf(b)) for a, b in zip(true, found, strict=True)) / size


def affine_mode(matrix, vector, guards=()):
    rows = zip((*matrix, *(c for c, _ in guards)), (*vector, *(d for _, d in guards)), strict=True)
    exact = tuple(tuple(map(Fraction, (*row, constant))) for row, constant in rows)
    return AffineMode(exact[: len(vector)], exact[len(vector) :])


def random_mode(random, size, mu, guards=0):
    matrix = random.normal(size=(size, size))
    matrix[0] *= -np.sign(matrix[0, 0]) / mu
    rows = [(tuple(random.normal(size=size)), 2 * size) for _ in range(guards)]
    return affine_mode(matrix.tolist(), random.normal(size=size).tolist(), rows)


@pytest.mark.parametrize("mu", [1e-1, 1e-4, 1e-8])
@pytest.mark.parametrize("size", [1, 2, 5, 8])
@pytest.mark.few(2)
def test_the_flow_is_exact_in_doubles_however_stiff(size, mu):
    random = np.random.default_rng(size)
    mode, start = random_mode(random, size, mu), random.normal(size=size)
    segment = ClosedSegment(mode.in_doubles, start)
    assert all(off(mode, start.tolist(), t, segment.state(t)) < 1e-14 for t in (mu / 7, 3 * mu, 1e-2, 1.7))


OSCILLATOR = [[0, 1, 0, 0], [-1, 0, 1, 0], [0, 0, 0, 1], [0, 0, -1, 0]]
DEFECTIVE = {
    "free motion": ([[0, 1, 0], [0, 0, 1], [0, 0, 0]], [0, 0, Fraction(1, 3)]),
    "coalescence": ([[0, 1], [-4, -4]], [1, 2]),
    "resonance": (OSCILLATOR, [0, 0, 0, 0]),
    "two equal oscillators": ([[0, 1, 0, 0], [-1, 0, 0, 0], [0, 0, 0, 1], [0, 0, -1, 0]], [0, 1, 0, 0]),
    "triple root": ([[-1, 1, 0], [0, -1, 1], [0, 0, -1]], [0, 0, 5]),
    "triple root left alone": ([[-2, 1, 0], [0, -2, 1], [0, 0, -2]], [0, 0, 0]),
    "nothing moves": ([[0, 0], [0, 0]], [0, 0]),
}


@pytest.mark.parametrize("name", DEFECTIVE)
def test_defective_blocks_lose_nothing(name):
    mode = affine_mode(*DEFECTIVE[name])
    start = [0.3, -1.7, 0.9, 2.2][: len(mode.rows)]
    segment = ClosedSegment(mode.in_doubles, start)
    assert all(off(mode, start, t, segment.state(t)) < 1e-15 for t in (1e-9, 0.2, 3.0, 40.0))


NEAR = {
    "resonance": lambda e: [[0, 1, 0, 0], [-1, 0, 1, 0], [0, 0, 0, 1 + e], [0, 0, -1 - e, 0]],
    "three rates": lambda e: [[-1, 1, 0], [0, -1 - e, 1], [0, 0, -1 + 2 * e]],
    "a slow turn": lambda e: [[-1, 1], [-(e**2), -1]],
    "a rate and a slow turn": lambda e: [[-1, 1, 0], [-(e**2), -1, 1], [0, 0, -1]],
}


@pytest.mark.parametrize("apart", ["1e-3", "1e-9", "1e-20"])
@pytest.mark.parametrize("name", NEAR)
@pytest.mark.few(4)
def test_no_weight_is_divided_by_a_difference_of_eigenvalues_near_one_another(name, apart):
    matrix = NEAR[name](Fraction(apart))
    mode, start = affine_mode(matrix, [0] * len(matrix)), [0.3, -1.7, 0.9, 2.2][: len(matrix)]
    segment, m = ClosedSegment(mode.in_doubles, start), digits(50)
    precise = ClosedSegment(in_digits(m, mode), [*map(m.mpf, start)])
    assert abs(segment.sums).max() < 10
    for t in (1e-9, 0.2, 3.0, 40.0):
        assert off(mode, start, t, segment.state(t)) < 2e-16 * (5 + t)  # a frequency has an error of rounding, too
        assert off(mode, start, t, precise.state(m.mpf(t))) < 1e-46


def test_modes_of_a_chain_of_masses_are_near_one_another_and_are_not_joined():
    """Their weights are at most 1; zeros that sums of two have by chance joined them, which took 1.6 times as long."""
    springs = -2 * np.eye(10, dtype=int) + np.eye(10, k=1, dtype=int) + np.eye(10, k=-1, dtype=int)
    rates = np.block([[0 * springs, np.eye(10, dtype=int)], [springs, 0 * springs]]).tolist()
    assert {block.size for block in affine_mode(rates, [0] * 20).in_doubles.blocks} == {1}


@pytest.mark.parametrize("unit", [Fraction(1, 10**9), 1, 10**6])
def test_weights_that_cancel_join_eigenvalues_in_all_units(unit):
    rates = [[0, 1, 0, 0], [-1, 0, unit, 0], [0, 0, 0, Fraction(101, 100)], [0, 0, Fraction(-101, 100), 0]]
    assert 2 in {block.size for block in affine_mode(rates, [0] * 4).in_doubles.blocks}


@pytest.mark.parametrize("apart", ["1e-2", "1e-9"])
@pytest.mark.parametrize("name", NEAR)
def test_bounds_hold_functions_of_eigenvalues_near_one_another(name, apart):
    matrix = NEAR[name](Fraction(apart))
    blocks = affine_mode(matrix, [0] * len(matrix)).in_doubles.blocks
    t = np.geomspace(1e-3, 1e3 / float(apart), 200)
    values = functions(Arrays, blocks, t)[0]
    for value, size in zip(values, sizes(Arrays, blocks, t, t), strict=True):
        assert (abs(value) <= size * (1 + 1e-6)).all()
    swept = areas(Arrays, blocks, t[:-1], t[1:])
    inner = functions(Arrays, blocks, (t[:-1] + t[1:]) / 2)[0]
    for value, area in zip(inner, swept, strict=True):
        assert (abs(value) * np.diff(t) <= 2 * area + 1e-300).all()


@pytest.mark.parametrize("t", [1, "1e-9"])
@pytest.mark.parametrize("apart", [(1, 1e-20, 1, 0), (1e-30, 1j, -1j, 1e-30), (-0.5, 1e-9j, -1e-9j)])
def test_divided_differences_in_digits_are_those_of_the_series_however_near_nodes_are(apart, t):
    """The divided difference of exp at k + 1 nodes is the sum of their complete symmetric polynomials h_n/(n + k)!."""
    m = digits(50)
    nodes, symmetric = [node * m.mpf(t) for node in apart], [1] + [0] * 60
    found = functions(m, [Block(m.mpf(0), 0, len(apart) + 1, apart)], m.mpf(t))[0]
    for k, node in enumerate(nodes, 1):
        for n in range(1, 60):
            symmetric[n] += node * symmetric[n - 1]
        true = sum(h / m.factorial(n + k) for n, h in enumerate(symmetric)) * m.mpf(t) ** k
        assert abs(found[k] - m.re(true)) < 1e-48 * m.mpf(t) ** k


def test_near_eigenvalues_that_beat_leave_no_root_beyond_what_their_amplitudes_allow():
    """Bounds that grew with the time never left the mesh: until = 1e6 took a hundred seconds in place of 4 ms."""
    matrix = NEAR["resonance"](Fraction(1, 100))
    mode = affine_mode(matrix, [0] * 4, [((-1, 0, 0, 0), 150)])
    assert ClosedSegment(mode.in_doubles, [0, 0, 1, 0]).first_event(1e6) is None
    assert len(mode.mesh._windows) == 1


@pytest.mark.parametrize("last", [1e3, 1e9, 1e14, 1e250])
@pytest.mark.parametrize("name", NEAR)
def test_functions_at_early_times_keep_their_digits_beside_much_later_ones(name, last):
    """The halvings of the latest time, by which all were scaled, left six digits at t = 0.5 beside t = 1e14."""
    blocks = affine_mode(NEAR[name](Fraction("1e-3")), [0] * len(NEAR[name](1))).in_doubles.blocks
    early = np.array([1e-9, 0.5, 3.0, 40.0])
    beside = functions(Arrays, blocks, np.array([*early, last]))[0]
    for k, t in enumerate(early.tolist()):
        alone = functions(Doubles, blocks, t)[0]
        off_sizes = np.array(rounding_sizes(Doubles, blocks, t)[1])
        assert (abs(np.array([values[k] for values in beside]) - alone) <= 2e-15 * off_sizes).all()


@pytest.mark.parametrize(("block", "degree"), [([[0, 1], [-1, 0]], 2), ([[-1, 1], [0, -1]], 2), ([[2]], 1)])
def test_an_eigenvalue_that_only_repeats_is_as_multiple_a_root_as_in_one_block(block, degree):
    for copies in (1, 3, 20):
        mode = affine_mode(np.kron(np.eye(copies, dtype=int), block).tolist(), [1] * (copies * len(block)))
        found = resolvent(mode.homogeneous)
        assert len(found.polynomial) - 1 == degree + 1
        whole, _ = in_whole_numbers(mode.homogeneous)
        factors = _square_free(eigenvalue_polynomial(whole))
        assert sum(most * (len(factor) - 1) for factor, most in factors) == len(mode.homogeneous)
    starts, alone = np.linspace(-1, 1, len(mode.rows)), affine_mode(block, [1] * len(block)).in_doubles
    expected = [ClosedSegment(alone, start).state(0.5) for start in starts.reshape(copies, -1)]
    assert ClosedSegment(mode.in_doubles, starts).state(0.5) == pytest.approx(np.concatenate(expected), rel=1e-14)


@pytest.mark.parametrize("mu", [1e-1, 1e-4, 1e-8])
def test_refined_eigenpairs_are_those_of_the_roots_of_the_characteristic_polynomial(mu):
    random = np.random.default_rng(11)
    for size in (2, 3, 6):
        rows = random_mode(random, size, mu).homogeneous
        whole, denominator = in_whole_numbers(rows)
        found = eigenpairs(whole, denominator, 320)
        values = sorted(zip(*found.values, strict=True))
        expected = sorted(b[:2] for b, _ in of_roots(rows, 320) if b.decay or b.turn)
        for pair, other in zip(values, expected, strict=True):
            assert all(abs(a - b) < 2.0**-200 * 2**320 for a, b in zip(pair, other, strict=True))
        parts = sum((1 + (turn != 0)) * part for turn, part in zip(found.values[1], found.parts[0], strict=True))
        off = parts + found.zero[0] - np.array(np.eye(size + 1, dtype=int), dtype=object) * 2**320
        assert abs(off).max() < 2.0**-200 * 2**320


def test_multiple_eigenvalues_other_than_zero_are_left_to_the_characteristic_polynomial():
    def of(rows, vector):
        return eigenpairs(*in_whole_numbers(affine_mode(rows, vector).homogeneous), 320)

    for name in ("coalescence", "resonance", "two equal oscillators", "triple root", "triple root left alone"):
        assert of(*DEFECTIVE[name]) is None
    assert len(of(*DEFECTIVE["free motion"]).zero) == 4
    assert len(of([[0, 1, 0], [-1, 0, 0], [0, 0, 0]], [0, 0, 0]).zero) == 1


@pytest.mark.parametrize("rate", [Fraction(1, 268_435_399), Fraction(268_435_399)])
def test_a_rate_with_a_large_prime_is_not_taken_for_zero(rate):
    found = exponential.exponential(((-rate, Fraction(0)), (Fraction(0), Fraction(-1))), 15)
    assert {round(block.decay / 2.0**found.bits * 2**40) for block in found.blocks} == {round(-rate * 2**40), -(2**40)}


def test_eigenvalues_that_equal_parts_of_a_chain_have_are_simple_in_each(monkeypatch):
    """Two blocks on either side of one that moves evenly have equal spectra, and so have the masses beside them."""
    monkeypatch.setattr(exponential, "of_roots", None)
    pair = [[0, 1, 0, 0], [-2, 0, 1, 0], [0, 0, 0, 1], [1, 0, -2, 0]]
    matrix, spring = np.kron(np.eye(3, dtype=int), pair), np.array([0, 0, 0, 1, 0, 1, 0, 0, 0, 0, 0, 0])
    still = np.array([[0, 1], [0, 0]])  # position and speed of the block between the first pairs, which nothing moves
    matrix = np.block([[matrix, np.column_stack([spring, 0 * spring])], [np.zeros((2, 12), dtype=int), still]])
    mode, start = affine_mode(matrix.tolist(), [0, 1] * 7), np.random.default_rng(2).normal(size=14)
    found = ClosedSegment(mode.in_doubles, start).state(2.5)
    assert off(mode, start.tolist(), 2.5, found) < 1e-14
    precise = ClosedSegment(in_digits(digits(50), mode), [*map(digits(50).mpf, start)]).state(digits(50).mpf(2.5))
    assert off(mode, start.tolist(), 2.5, precise) < 1e-48


def test_the_same_flow_runs_on_any_number_of_digits():
    random = np.random.default_rng(3)
    mode, start = random_mode(random, 4, 1e-3), random.normal(size=4)
    for n in (22, 50, 200):
        m = digits(n)
        found = ClosedSegment(in_digits(m, mode), [m.mpf(v) for v in start]).state(m.mpf(0.75))
        assert off(mode, start.tolist(), 0.75, found, dps=n + 20) < 10.0 ** (3 - n)


def test_a_short_step_keeps_the_digits_of_its_increment():
    mode = affine_mode([[-1, 1], [0, -2]], [0, 0])
    moved = ClosedSegment(mode.in_doubles, [0.0, 1.0]).state(1e-20)
    assert moved[0] == pytest.approx(1e-20, rel=1e-15)


@pytest.mark.further
def test_the_first_root_of_several_guards_is_found_on_random_systems():
    random = np.random.default_rng(11)
    for _ in range(20):
        mode = random_mode(random, int(random.integers(2, 7)), 10.0 ** -random.integers(1, 9), guards=2)
        start = random.uniform(-1, 1, len(mode.rows)).tolist()
        segment = ClosedSegment(mode.in_doubles, start)
        if (segment.guards[segment.functions] <= 0).any():
            continue
        found = segment.first_event(2.0)
        until = found[0] if found else 2.0
        rows = segment.flow.rows
        slowly = [rows[:, :-1] @ segment.state(t) + rows[:, -1] for t in np.linspace(0, until, 2000)[:-1]]
        assert (np.array(slowly) > 0).all()
        if found:
            (guard,) = found[1]
            *c, d = mode.guards[guard]
            at = np.array(truth(mode, start, until))
            value, rate = at @ np.array(c, dtype=float) + float(d), np.array(mode.rows, dtype=float) @ [*at, 1]
            assert abs(value / (rate @ np.array(c, dtype=float))) < 1e-14 * until + 1e-15


def height(level, start=(0, 0)):
    """Return a segment of ``x'' = -x`` with the one guard ``level - x``."""
    mode = affine_mode([[0, 1], [-1, 0]], [0, 0], [((-1, 0), level)])
    return ClosedSegment(mode.in_doubles, [float(v) for v in start])


@pytest.mark.parametrize("gap", [1e-2, 1e-6, 1e-10])
def test_two_close_roots_are_told_apart(gap):
    level = Fraction(1) - Fraction(gap)
    time, _ = height(level, (0, 1)).first_event(100.0)
    with mpmath.mp.workdps(40):
        true = mpmath.asin(mpmath.mpf(1) - mpmath.mpf(gap))
    assert abs(time - true) < 1e-15 / gap**0.5


@pytest.mark.parametrize("power", [4, 20, 30])
def test_two_close_roots_are_told_apart_to_all_digits(power):
    m, gap = digits(100), Fraction(1, 10**power)
    mode = affine_mode([[0, 1], [-1, 0]], [0, 0], [((-1, 0), 1 - gap)])
    time, _ = ClosedSegment(in_digits(m, mode), [m.zero, m.one]).first_event(m.mpf(100))
    with mpmath.mp.workdps(140):
        assert abs(time - mpmath.asin(mpmath.mpf(1) - mpmath.mpf(10) ** -power)) < mpmath.mpf(10) ** (power / 2 - 98)
    above = affine_mode([[0, 1], [-1, 0]], [0, 0], [((-1, 0), 1 + gap)])
    assert ClosedSegment(in_digits(m, above), [m.zero, m.one]).first_event(m.mpf(100)) is None


def test_a_guard_that_is_nearly_touched_is_not_hit():
    assert height(Fraction(1) + Fraction(1, 10**11), (0, 1)).first_event(100.0) is None


def test_what_rounding_hides_is_undecided_and_more_digits_tell():
    level = Fraction(1) + Fraction(1, 10**18)
    mode = affine_mode([[0, 1], [-1, 0]], [0, 0], [((-1, 0), level)])
    with pytest.raises(Undecided):
        ClosedSegment(mode.in_doubles, [0.0, 1.0]).first_event(4.0)
    m = digits(40)
    assert ClosedSegment(in_digits(m, mode), [m.zero, m.one]).first_event(m.mpf(4)) is None


def test_a_root_in_a_layer_of_a_ten_billionth_of_the_time_is_found():
    mode = affine_mode([[-(10**10), 0], [0, 0]], [0, 0], [((-1, 1), 0), ((1, 1), 5)])
    t, _ = ClosedSegment(mode.in_doubles, [-1.0, -0.5]).first_event(10.0)
    assert t == pytest.approx(np.log(2) * 1e-10, rel=1e-13)


def test_a_guard_that_vanishes_at_the_start_is_no_event_there():
    ball = affine_mode([[0, 1], [0, 0]], [0, -1], [((1, 0), 0)])
    assert ClosedSegment(ball.in_doubles, [0.0, 1e-12]).first_event(1.0) == (pytest.approx(2e-12, rel=1e-15), (0,))
    assert ClosedSegment(ball.in_doubles, [0.0, 3.0]).first_event(1.0) is None


def test_a_growing_part_is_met_before_it_overflows_or_not_at_all():
    mode = affine_mode([[10**8, 0], [0, 0]], [0, 1], [((-1, 0), 1)])
    t, _ = ClosedSegment(mode.in_doubles, [1e-30, 0.0]).first_event(5.0)
    assert t == pytest.approx(np.log(1e30) / 1e8, rel=1e-14)
    assert ClosedSegment(mode.in_doubles, [0.0, 0.0]).first_event(5.0) is None
    with pytest.raises(OverflowError):
        ClosedSegment(mode.in_doubles, [1e-300, 0.0]).first_event(5.0)
    away = affine_mode([[10**8, 0], [0, 0]], [0, 1], [((1, 0), 1)])
    with pytest.raises(TooLarge, match="take a smaller until"):
        ClosedSegment(away.in_doubles, [1.0, 0.0]).first_event(5.0)
    m = digits(30)
    found, _ = ClosedSegment(in_digits(m, mode), [m.mpf("1e-300"), m.zero]).first_event(m.mpf(5))
    assert float(found) == pytest.approx(300 * np.log(10) / 1e8, rel=1e-14)


def test_a_mode_of_too_many_states_is_refused():
    with pytest.raises(InputError, match="takes 64"):
        _ = affine_mode(np.eye(64, dtype=int).tolist(), [0] * 64).in_doubles


def test_entries_of_a_thousand_digits_have_the_exponential_of_their_first_hundred():
    """Of long whole numbers, whose products took most of the time, no more bits are multiplied than are needed."""
    with mpmath.workdps(1200):
        numbers = [mpmath.sqrt(k) for k in (2, 3, 5, 7)]
        long, short = ([Fraction(int(v * 10**digits), 10**digits) for v in numbers] for digits in (1100, 100))
    found = []
    for a, b, c, d in (long, short):
        entries = ((a, -b, Fraction(0)), (c, d, Fraction(1)), (Fraction(0), a, -c))
        found.append([*of_roots(entries, 200)])
    assert [block.size for block, _ in found[0]] == [block.size for block, _ in found[1]]
    for (block, matrices), (other, others) in zip(*found, strict=True):
        assert max(abs(block.decay - other.decay), abs(block.turn - other.turn), abs(matrices - others).max()) <= 4
