"""Certificates: balls that contain the exact flow, and refusals by name where nothing can be proven."""

import json
import math
import pickle
import random
import re
from fractions import Fraction
from itertools import pairwise

import pytest

import asympk as ap
from asympk.__main__ import main
from asympk.errors import InputError, MissingPackage
from asympk.scenes import scenefile

flint = pytest.importorskip("flint")

from asympk.certify import Certificate, certificates, certify, cover  # noqa: E402
from asympk.certify.balls import Refused, ball, ball_of, common, hull, times  # noqa: E402
from asympk.certify.enclosure import Budget, LevelGuard, first_event  # noqa: E402
from asympk.certify.proofs import Inequality, inequalities, prove  # noqa: E402
from asympk.output.terminal import certificates_as_text, covered  # noqa: E402

BACKWARD = ap.Scene(1, "1e-6", (0, "0.2", -1), 5)


def _fraction(value):
    sign, mantissa, exponent, _ = value._mpf_
    return Fraction(-int(mantissa) if sign else int(mantissa)) * Fraction(2) ** int(exponent)


def _holds(certificate, path, slack=10**-55):
    """Tell whether every number of a path of 60 digits lies in its ball, and the sequences are the same."""
    pairs = [*zip(path.final, certificate.final, strict=True)]
    for event, enclosed in zip(path.events, certificate.events, strict=True):
        pairs += zip((event.t, *event.state), (enclosed.t, *enclosed.state), strict=True)
    kinds = [event.kind for event in path.events] == [event.kind for event in certificate.events]
    return kinds and path.modes == certificate.modes and all(_contains(b, v, slack) for v, b in pairs)


def _contains(enclosure, value, slack=0):
    exact = _fraction(value) if hasattr(value, "_mpf_") else Fraction(value)
    with flint.ctx.workprec(600):
        room = flint.arb(0, 1) * ball(Fraction(slack) * max(1, abs(exact)))
        return bool((enclosure + room).contains(ball(exact)))


@pytest.mark.parametrize(("x", "y", "mode"), [("1/20", "1/20", "slip_same"), ("-1/5", "-1/5", "slip_opposite")])
def test_a_box_at_rest_outside_the_static_cone_begins_to_slip_as_its_load_pushes(x, y, mode):
    scene, near = ap.Scene(1, "1e-3", (x, y, 0), "1e-4"), Fraction(1, 1000)
    found = certify(scene, {"x": (Fraction(x) - near, Fraction(x) + near)})
    assert found.proven
    assert found.modes == (mode,) == ap.solve(scene).modes
    assert all(_contains(b, v) for b, v in zip(found.final, ap.solve(scene, digits=20).final, strict=True))


@pytest.mark.parametrize("side", ["sigma", "mu", "until"])
def test_a_side_without_length_leaves_the_proof_of_a_point(side):
    scene = ap.Scene(1, "1/100", ("1/10", "1/10", 0), 2, sigma0=2)  # on the edge of the static cone
    value = Fraction(getattr(scene, side))
    point, found = certify(scene, digits=60), certify(scene, {side: (value, value)}, digits=60)
    assert found.proven
    assert (found.modes, found.bits) == (point.modes, point.bits)
    assert [*map(repr, found.final)] == [*map(repr, point.final)]


@pytest.mark.parametrize(("z", "side"), [(-1, "until"), (-1, "sigma"), (-1, "mu"), (1, "z"), (0, "until"), (0, "mu")])
def test_the_load_of_a_box_begins_at_0_where_x_and_y_cancel_exactly(z, side):
    scene = ap.Scene(-1 if z else 1, "1/100", ("-1/5", "1/5", z), "1/2")  # balls of 1/5 and -1/5 do not cancel
    middle = scene.start[2] if side == "z" else getattr(scene, side)
    low, high = (Fraction(middle) + Fraction(k, 10**6) for k in (-1, 1))
    found = certify(scene, {side: (low, high)})
    assert found.proven
    for value in (low, high):
        numbers = {"sigma": scene.sigma, "mu": scene.mu, "z": z, "until": scene.until, side: value}
        start = (*scene.start[:2], numbers.pop("z"))
        assert _holds(found, ap.solve(ap.Scene(**numbers, start=start), digits=60))


def test_a_box_beside_a_slow_line_whose_load_has_either_sign_is_refused():
    scene = ap.Scene.near("Pi1", x=0, offset="-1/5", z=1, sigma=1, mu="1e-3", until=1)  # x + y = 1/(sigma + 4) - 1/5
    assert certify(scene).proven
    found = certify(scene, {"sigma": ("99/100", "101/100")})
    assert not found.proven
    assert found.reason == "start: the sign of x + y or z is not certain"


@pytest.mark.parametrize("manifold", ["Pi1", "Pi2"])
def test_a_start_beside_a_slow_line_away_from_x_0_is_proven(manifold):
    scene = ap.Scene.near(manifold, x="-1/2", offset="1e-9", z=1, sigma=1, mu="1/10", until=1)
    assert _holds(certify(scene), ap.solve(scene, digits=60), 10**-40)


def _random_scene(rnd):
    sigma = Fraction(rnd.randint(-1999, 8000), 1000)
    mu = Fraction(rnd.randint(1, 99)) / 10 ** rnd.randint(0, 7)
    x, y, z = (Fraction(rnd.randint(-3000, 3000), 1000) for _ in range(3))
    kind = rnd.choice(["free"] * 6 + ["z = 0", "s = 0", "both", "sigma = 0", "sigma = -1"])
    y = -x if kind in ("s = 0", "both") else y
    z = Fraction(0) if kind in ("z = 0", "both") else z
    sigma = {"sigma = 0": Fraction(0), "sigma = -1": Fraction(-1)}.get(kind, sigma)
    excess = Fraction(rnd.randint(0, 2000), 1000) if rnd.random() < 0.3 else 0
    return ap.Scene(sigma, mu, (x, y, z), 5, sigma + excess)


@pytest.mark.slow
def test_certificates_hold_on_random_scenes_against_sixty_digits():
    rnd = random.Random(20)
    for _ in range(120):
        scene = _random_scene(rnd)
        certificate = certify(scene)
        assert certificate.proven, (certificate.reason, scene)
        assert _holds(certificate, ap.solve(scene, digits=60)), scene


@pytest.mark.parametrize("name", scenefile.scene_names())
def test_every_scene_that_ships_is_proven(name):
    found = scenefile.read_scene(name)
    certificate = certify(found)
    assert certificate.proven
    slack = 10**-55 if found.rod is None else 10**-50
    assert _holds(certificate, ap.solve(found, digits=60), slack)


def test_without_time_nothing_happens():
    certificate = certify(ap.Scene(1, "1e-3", (0, 0, -1), 0))
    assert certificate.modes == ("slip_opposite",)
    assert all(value.contains(k) for value, k in zip(certificate.final, (0, 0, -1), strict=True))


def test_radii_shrink_to_the_digits_asked_for():
    assert all(value.rad() < flint.arb(10) ** -40 for value in certify(BACKWARD, digits=40).final)


def test_a_pickled_certificate_holds_what_it_held():
    certificate = certify(BACKWARD, digits=40)
    again = pickle.loads(pickle.dumps(certificate))
    assert repr(again) == repr(certificate)
    pairs = zip(again.final, certificate.final, strict=True)
    assert all(loaded.contains(ball) and loaded.rad() < flint.arb(10) ** -40 for loaded, ball in pairs)


def test_a_wrong_digit_is_not_in_the_ball():
    path = ap.solve(BACKWARD, digits=60)
    certificate = certify(BACKWARD)
    assert not _contains(certificate.final[0], _fraction(path.final[0]) + Fraction(1, 10**18))


def test_a_decimal_that_became_a_float_gets_another_ball():
    """0.1 the double is not 1/10: each certificate holds for its own number and excludes the other's path."""
    decimal, double = (ap.Scene(1, mu, (0, "0.2", -1), 5) for mu in ("0.1", 0.1))
    certificates = [certify(scene, digits=25) for scene in (decimal, double)]
    paths = [ap.solve(scene, digits=60) for scene in (decimal, double)]
    assert [[_holds(c, p) for c in certificates] for p in paths] == [[True, False], [False, True]]


@pytest.mark.parametrize("value", [Fraction(1, 3), Fraction(1, 10), Fraction(10**40 + 1, 7), -Fraction(1, 10**30)])
def test_a_ball_of_a_fraction_contains_it_where_the_float_does_not(value):
    enclosure = ball(value) * value.denominator
    assert enclosure.contains(ball(value.numerator))
    with flint.ctx.workprec(400):
        assert ball(float(value)).is_exact()
        assert ball(float(value)) * value.denominator != value.numerator


def test_a_product_of_wide_balls_keeps_its_sign():
    wide, other = hull(Fraction(1, 10), 2), hull(Fraction(-3), Fraction(-1, 3))
    assert (wide * other).contains(0)
    assert times(wide, other) < 0
    assert times(wide, other).contains(ball(-6))
    assert times(wide, other).contains(ball(Fraction(-1, 30)))


def test_enclosures_of_one_number_that_have_nothing_in_common_are_an_error():
    with pytest.raises(Refused, match="contradiction"):
        common(ball(1), ball(2))


def test_an_expression_as_a_ball_agrees_with_sixty_digits():
    import sympy as sp

    a, b = sp.symbols("a b")
    expr = sp.sqrt(a) * sp.tan(b) / (1 + a**2) - sp.cos(sp.pi / 7) + sp.E * sp.Rational(1, 3)
    with flint.ctx.workprec(200):
        enclosure = ball_of(expr, {a: ball(Fraction(2, 7)), b: ball(Fraction(1, 9))})
    exact = expr.subs({a: sp.Rational(2, 7), b: sp.Rational(1, 9)}).evalf(80)
    assert _contains(enclosure, exact, Fraction(1, 10**55))
    with pytest.raises(Refused, match="no enclosure"):
        ball_of(sp.gamma(a), {a: ball(1)})


# sigma = 0 makes slip_opposite polynomial, so that coincidences can be had exactly
@pytest.mark.parametrize(
    ("obstacle", "start", "until"),
    [
        ("grazing", ("-1/2", -1, "1/3"), 5),
        ("horizon", ("1/2", -1, 5), 1),
        ("simultaneous", ("19/8", -2, "-7/12"), 5),
        ("edge", ("65/24", -2, "-3/4"), 5),
    ],
)
@pytest.mark.few(2)
def test_coincidences_are_refused_by_name(obstacle, start, until):
    refused = certify(ap.Scene(0, 1, start, until))
    assert not refused.proven
    assert refused.obstacle == obstacle
    assert refused.final == ()


def test_an_event_is_refused_that_only_some_points_of_a_box_have_before_the_end():
    # after an event whose time ranges, too, the end of the motion comes sooner or later in this mode
    at_end = certify(ap.Scene(1, "1e-2", (0, "0.2", -1), "0.0913"), {"y": ("0.2", "0.21")})
    assert at_end.obstacle == "horizon"


@pytest.mark.slow
@pytest.mark.parametrize("sigma", [1, 2, 5])
def test_a_start_on_the_unstable_plane_is_refused(sigma):
    refused = certify(ap.Scene(sigma, "1e-4", (Fraction(-1, sigma), 0, 1), 5))
    assert refused.obstacle == "unstable plane"


@pytest.mark.parametrize("sigma", ["1e-8", "1e-20", "-1e-20", "1e-300"])
def test_beside_sigma_0_where_parts_of_a_motion_cancel_it_is_proven_in_few_pieces(sigma, monkeypatch):
    monkeypatch.setattr("asympk.certify.certificates.WORK", 250)
    scene = ap.Scene(sigma, "1e-3", (0, "0.2", -1), 1)
    certificate = certify(scene)
    assert certificate.proven
    assert _holds(certificate, ap.solve(scene, digits=60))


@pytest.mark.parametrize("nudge", [Fraction(1, 10**30), -Fraction(1, 10**30)])
def test_beside_a_coincidence_the_certificate_tells_the_sides_apart(nudge):
    scene = ap.Scene(0, 1, (Fraction(-1, 2), -1, Fraction(1, 3) + nudge), 5)
    certificate = certify(scene)
    assert certificate.proven
    assert (certificate.events[0].kind == "velocity_zero") == (nudge < 0)
    assert _holds(certificate, ap.solve(scene, digits=60))


@pytest.mark.parametrize(
    ("sigma", "start"),
    [(1, ("1/4", 0, 0)), (1, ("-1/2", 0, 0)), (1, ("-0.75", 1, 0)), (1, ("-999.5", 1000, 0)), ("-3/2", (2, 0, 0))],
)
def test_a_start_on_an_edge_of_the_static_cone_is_decided_for_all_compliances_of_a_box(sigma, start):
    found = certify(ap.Scene(sigma, "1/1000", start, 1), {"mu": ("999e-6", "1001e-6")})
    assert found.proven, found.reason
    for mu in ("999e-6", "1/1000", "1001e-6"):
        assert _holds(found, ap.solve(ap.Scene(sigma, mu, start, 1), digits=60), slack=10**-40)


def test_a_start_with_a_load_whose_rate_changes_its_sign_within_a_box_is_refused():
    found = certify(ap.Scene(1, "1/1000", (1000, -1000, -1), 1), {"mu": ("999e-6", "1001e-6")})
    assert found.reason == "start: the rate of x + y does not have one sign throughout"


def test_starts_on_edges_of_the_static_cone_are_decided_exactly():
    """On s = 1/4, sticking moves s at the rate y - 25: inwards above y = 25, outwards below."""
    for y, first in ((0, "slip_same"), (24, "slip_same"), (26, "stick"), (30, "stick")):
        scene = ap.Scene(1, "1e-2", (Fraction(1, 4) - y, y, 0), 5)
        certificate = certify(scene)
        assert certificate.modes[0] == first
        assert _holds(certificate, ap.solve(scene, digits=60))


@pytest.mark.parametrize(
    "box",
    [
        {"y": ("0.1", "0.3")},
        {"mu": ("1e-6", "1.1e-6")},
        {"sigma": ("0.9", "1.1")},
        {"x": ("-0.01", "0.01"), "z": ("-1.1", "-0.9"), "until": (4, 5)},
    ],
)
def test_a_certificate_on_a_box_holds_at_its_corners_and_inside(box):
    certificate = certify(BACKWARD, box)
    assert certificate.modes == ("slip_opposite", "stick", "slip_same")
    rnd = random.Random(3)
    for part in (0, 1, Fraction(rnd.randint(1, 99), 100)):
        at = {name: Fraction(low) + (Fraction(high) - Fraction(low)) * part for name, (low, high) in box.items()}
        start = tuple(at.get(axis, value) for axis, value in zip("xyz", BACKWARD.start, strict=True))
        point = ap.Scene(at.get("sigma", 1), at.get("mu", Fraction(1, 10**6)), start, at.get("until", 5))
        assert _holds(certificate, ap.solve(point, digits=60))


ROD = {"m": "0.5", "P": 20, "f": "1.2", "alpha": "75 deg", "l": "0.3", "k": 200_000, "h": "0.1"}
IN_UNITS = ap.Scene.physical(**ROD, start=("1.5", "0.7", "-0.5"), until="0.2")


@pytest.mark.parametrize("box", [
    {"k": (190_000, 200_000)},
    {"f": ("1.19", "1.2"), "u": ("-0.5", "-0.495")},
    {"alpha": ("74.9 deg", "75 deg"), "m": ("0.5", "0.501")},
    {"f0": ("1.2", "1.25"), "R_1": (1, 2), "dR_1": (0, 1)},
    {"l": ("0.299", "0.3"), "h": ("0.1", "0.1001"), "until": ("0.19", "0.2")},
])
def test_a_certificate_on_a_box_of_physical_quantities_holds_at_its_corners_and_inside(box):
    certificate = certify(IN_UNITS, box)
    assert certificate.modes == ("slip_opposite", "stick", "slip_same")
    for part in (0, 1, Fraction(1, 3)):
        at = {name: low + (high - low) * part for name, (low, high) in certificate.box.items()}
        quantities = {name: at.get(name, value) for name, value in {"f0": at.get("f", "1.2"), **ROD}.items()}
        start = [at.get(name, value) for name, value in zip(("R_1", "dR_1", "u"), ("1.5", "0.7", "-0.5"), strict=True)]
        point = ap.Scene.physical(**quantities, start=start, until=at.get("until", "0.2"))
        assert _holds(certificate, ap.solve(point, digits=60))


def test_the_pieces_of_a_box_of_angles_cover_it():
    pieces = cover(IN_UNITS, {"alpha": ("60 deg", "75 deg")}, pieces=4)
    ends = sorted(piece.box["alpha"] for piece in pieces)
    assert len(pieces) > 1
    assert all(high == low for (_, high), (low, _) in pairwise(ends))
    assert (ends[0][0], ends[-1][1]) == pytest.approx((math.pi / 3, math.pi * 5 / 12), rel=1e-15)


def test_the_command_takes_a_box_in_the_units_of_the_file_and_a_mere_number_of_degrees_as_degrees(capsys, tmp_path):
    file = tmp_path / "rod.toml"
    rod = [f'{name} = "{value}"' for name, value in ROD.items()]
    file.write_text("\n".join([*rod, "start = [0, 0, -0.5]", "until = 0.2"]))
    for ends in (("74.9", "75"), ("74.9 deg", "75 deg"), ("749/1800*pi", "75/180*pi")):
        assert main(["certify", str(file), "--box", "alpha", *ends]) == 0
        assert "\nproven: slip_opposite -> stick -> slip_same" in capsys.readouterr().out


@pytest.mark.parametrize(("box", "said"), [
    ({"f": (1, 2), "mu": (1, 2)}, "f is physical and mu is not"),
    ({"f0": (1, 2)}, "f0 must not be below f anywhere; it is 1 where f is 6/5"),
    ({"f": (1, 2), "f0": (1, 3)}, "f0 must not be below f anywhere; it is 1 where f is 2"),
    ({"m": (0, 1)}, "m = 0: it must be positive"),
    ({"alpha": ("89 deg", "91 deg")}, "between 0 and 90 degrees"),
    ({"q": (0, 1)}, "choose one of sigma, mu, sigma0, x, y, z, until, m, P, f, f0, alpha, l, k, h, R_1, dR_1, u$"),
])
def test_what_is_no_box_of_physical_quantities_is_refused(box, said):
    with pytest.raises(InputError, match=said):
        certify(IN_UNITS, box)


def test_the_pieces_of_a_box_cover_it_and_hold():
    scene = ap.Scene(1, "1e-3", (0, 0, 1), 5)
    pieces = cover(scene, {"x": (-2, 2)}, pieces=32)
    ends = sorted(piece.box["x"] for piece in pieces)
    assert ends[0][0] == -2
    assert ends[-1][1] == 2
    assert all(a[1] == b[0] for a, b in pairwise(ends))
    assert {piece.obstacle for piece in pieces if not piece.proven} <= {"unstable plane", "start", "edge"}
    for piece in pieces:
        low, high = piece.box["x"]
        middle = ap.Scene(1, "1e-3", ((low + 2 * high) / 3, 0, 1), 5)
        assert not piece.proven or _holds(piece, ap.solve(middle, digits=60))


@pytest.mark.parametrize(
    ("box", "said"),
    [
        ({"f": (0, 1)}, "no parameter, state or horizon; choose one of sigma, mu, sigma0, x, y, z, until"),
        ({"x": (1, 0)}, "empty"),
        ({"x": (1,)}, "two numbers"),
        ({"mu": (0, 1)}, "above 0"),
        ({"sigma": (-3, 1)}, "above -2"),
        ({"sigma0": (0, 1)}, "below sigma"),
        ({"x": ("a", 1)}, "decimal"),
    ],
)
def test_what_is_no_box_is_refused(box, said):
    with pytest.raises(InputError, match=said):
        certify(BACKWARD, box)


def test_the_claims_that_are_inequalities_are_proven_on_their_boxes():
    proofs = [prove(inequality) for inequality in inequalities()]
    assert all(proof.proven for proof in proofs)
    assert {proof.inequality.claim for proof in proofs} == {"C16", "C19", "C22", "C27", "C29", "C30", "C31"}


def test_a_false_inequality_is_not_proven():
    from asympk.systems.painleve_klein import sigma

    assert not prove(Inequality("C22", "false beyond 1", (1 - sigma,), {sigma: (0, 2)})).proven
    assert not prove(Inequality("C22", "false at 1 alone", ((1 - sigma) ** 2,), {sigma: (0, 3)})).proven


def test_the_command_shows_the_events_that_solve_shows_in_as_many_rows(capsys):
    rows = []
    for command in ("solve", "certify"):
        assert main([command, "collisions"]) == 0
        out = capsys.readouterr().out
        rows.append([(*map(float, numbers.split()), words) for numbers, words in
                     re.findall(r"^([-+.e\d ]+)  (\w+_\w+ -> \w+)$", out, re.MULTILINE)])
    followed, proven = rows
    assert [row[-1] for row in proven] == [row[-1] for row in followed]
    assert len(proven) == 5
    for one, other in zip(followed, proven, strict=True):
        assert one[:-1] == pytest.approx(other[:-1], rel=1e-7)


@pytest.mark.further
def test_the_command_tells_a_proof_from_a_refusal(capsys, tmp_path):
    assert main(["certify", "backward", "--json"]) == 0
    (told,) = json.loads(capsys.readouterr().out)
    assert (told["names"], told["modes"]) == (["x", "y", "z"], ["slip_opposite", "stick", "slip_same"])
    assert "+/-" in told["final"][0]
    grazing = tmp_path / "grazing.toml"
    grazing.write_text('sigma = 0\nmu = 1\nstart = ["-1/2", -1, "1/3"]\nuntil = 5\n')
    assert main(["certify", str(grazing)]) == 1
    assert "\nundecided: grazing" in capsys.readouterr().out
    box = ["certify", "backward", "--box", "sigma", "0.5", "2"]
    assert main(box) == 0
    told = capsys.readouterr().out
    assert "\nfor all sigma from 0.5 to 2\n3 of 3 pieces of the box proven, 100% of its volume" in told
    assert "more --pieces" not in told
    assert main([*box, "--pieces", "1"]) == 1
    assert "\nmore --pieces, or a smaller box, may prove what is undecided\n" in capsys.readouterr().out
    assert main(["certify", "--claims"]) == 0
    assert "undecided" not in capsys.readouterr().out


@pytest.mark.parametrize("rest", [Fraction(1, 10**9), Fraction(1, 10**30)])
def test_a_box_with_pieces_left_is_not_said_to_be_proven_all_over_however_small_they_are(rest):
    scene = scenefile.read_scene("backward")
    whole, left = {"x": (0, 1 - rest)}, {"x": (1 - rest, 1)}
    pieces = Certificate(scene, True, final=(hull(0, 1),) * 3, box=whole), Certificate(scene, False, box=left)
    assert "1 of 2 pieces of the box proven, nearly 100% of its volume" in certificates_as_text(pieces, 9)



def test_without_python_flint_the_error_gives_the_pip_line(monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "flint", None)
    with pytest.raises(MissingPackage, match=r"pip install 'asympk\[certified\]'"):
        certify(BACKWARD)


@pytest.mark.parametrize(
    ("sigma", "mu", "until"), [(-1e-300, 2.5e-301, 5), (0, 1e-300, 5), (0, 1e-3, 1e300), (1, 0.25, 1e300)]
)
def test_work_without_end_is_refused_at_once_as_undecided(sigma, mu, until):
    found = certify(ap.Scene(sigma, mu, (0, 0.2, -1), until))
    assert not found.proven
    assert found.obstacle == "undecided"


def test_a_certificate_whose_work_is_spent_is_undecided(monkeypatch):
    monkeypatch.setattr("asympk.certify.certificates.WORK", 3)
    assert certify(BACKWARD).reason.startswith("undecided: 3 pieces of work are spent")


@pytest.mark.further
def test_parts_of_a_wide_box_are_proven():
    box = {"sigma": ("0.5", 2), "mu": ("1e-3", "1e-2"), "y": ("0.1", "0.3")}
    assert sum(piece.proven for piece in cover(ap.Scene(1, "1e-3", (0, "0.2", -1), 5), box, 24)) >= 1


def breadth_first(scene, box, pieces):
    """Return the certificates of pieces that are halved one after the other, each along its longest side."""
    done, todo = [], [certify(scene, box)]
    while todo:
        found = todo.pop(0)
        if found.proven or len(done) + len(todo) + 1 >= pieces:
            done.append(found)
            continue
        whole = {name: float(high) - float(low) for name, (low, high) in box.items()}
        name = max(box, key=lambda k: float(found.box[k][1] - found.box[k][0]) / whole[k])
        low, high = found.box[name]
        ends = (low, (low + high) / 2), ((low + high) / 2, high)
        todo += [certify(scene, {**found.box, name: half}) for half in ends]
    return done


def test_a_box_with_one_side_is_tried_once_a_piece_and_tells_how_far_it_is(monkeypatch):
    tried, heard, attempt = [], [], certificates._attempt
    monkeypatch.setattr(certificates, "_attempt", lambda scene, sides, *rest: (tried.append(sides["x"]),
                                                                               attempt(scene, sides, *rest))[1])
    found = cover(ap.Scene(1, "1e-3", (0, 0, "-1"), 1), {"x": (-2, 2)}, 8, lambda *parts: heard.append(parts))
    assert len(tried) == len({*tried}) == 2 * len(found) - 1
    assert [cut for _, cut in heard] == [*range(1, len(found))]
    assert all(proven < cut for proven, cut in heard)


@pytest.mark.further
def test_cutting_where_it_is_undecided_proves_more_of_a_wide_box_than_cutting_all_alike():
    scene, box = ap.Scene(1, "1e-3", (0, "0.2", -1), 5), {"sigma": ("0.5", 2), "mu": ("1e-4", "1e-2")}
    found = cover(scene, box, 24)
    assert len(found) == 24
    assert covered(found) > 2 * covered(breadth_first(scene, box, 24))


def test_a_guard_without_a_sign_from_the_start_on_is_refused_as_grazing_before_the_work_is_spent():
    class Blurred:
        unstable, work = False, 1

        def jet(self, guard, t, order=0):
            return (flint.arb(0, 1),) * (order + 1)

    with pytest.raises(Refused, match=r"^grazing: velocity_zero may or may not happen as soon as this mode begins$"):
        first_event(Blurred(), [LevelGuard("velocity_zero", "z", 1, 0)], ball(1), Budget(2000, wide=True))
