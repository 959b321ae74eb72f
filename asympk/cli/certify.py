"""``asympk certify``: proofs in ball arithmetic."""

from argparse import ArgumentParser, Namespace

from asympk.cli.options import add_scene, given_scene, meter, scene_numbers, whole_number
from asympk.errors import InputError

HELP = "prove what a scene does, in ball arithmetic"


def arguments(parser: ArgumentParser) -> None:
    add_scene(parser)
    parser.add_argument("--box", nargs=3, action="append", metavar=("NAME", "LOW", "HIGH"),
                        help="let a parameter, a state of the start, or the rod's until range from LOW to HIGH, in the "
                             "units of the scene; may be repeated")
    parser.add_argument("--pieces", type=whole_number, default=64, help="cut the box into at most so many pieces (64)")
    parser.add_argument("--digits", type=whole_number, default=15, help="digits of the final state (15)")
    parser.add_argument("--claims", action="store_true", help="instead, prove the claims that are inequalities")
    parser.add_argument("--json", action="store_true", help="print the certificate as JSON")


def run(options: Namespace) -> int:
    """Prove the motion of the scene or of its box, or the inequalities; return 1 where a proof is not found."""
    from asympk.numbers import whole as require_whole

    given = options.box or options.json or options.set or options.scene is not None or scene_numbers(options)
    if options.claims and given:
        raise InputError("certify takes either a scene, which may have --set, --box and --json, or --claims alone")
    require_whole("--digits", options.digits, 1, 300)
    require_whole("--pieces", options.pieces, 1, 100_000)
    return _prove_claims() if options.claims else _prove_scene(options)


def _prove_claims() -> int:
    from asympk.certify.proofs import inequalities, prove
    from asympk.output.terminal import proofs_as_text

    with meter("proving the inequalities"):
        found = [prove(inequality) for inequality in inequalities()]
    print(proofs_as_text(found))
    return 0 if all(proof.proven for proof in found) else 1


def _prove_scene(options: Namespace) -> int:
    from asympk.certify import certify, cover
    from asympk.formulas import read_constants
    from asympk.output.terminal import below_scene, certificates_as_json, certificates_as_text
    from asympk.scenes.turned import as_in_file, scene_parameters

    box = {name: ends for name, *ends in options.box or ()}
    if len(box) < len(options.box or ()):
        raise InputError("--box: a name is given twice; give each one range")
    scene = given_scene(options)
    angles = scene.system is not None
    own = scene_parameters(scene)
    sides = {name: read_constants(f"box {name}", [as_in_file(own.get(name), end) for end in ends], angles)
             for name, ends in box.items()}
    with meter("proving", log=True) as shown:
        def tell(proven, cut):
            shown.tell(f"proving, {proven} pieces proven, {cut - proven} left, of at most {options.pieces}")

        found = cover(scene, sides, options.pieces, tell) if box else (certify(scene, digits=options.digits),)
    if options.json:
        print(certificates_as_json(found, options.digits + 2))
    else:
        over = ", ".join(f"{name} from {low} to {high}" for name, (low, high) in box.items())
        print(below_scene(scene, over and f"for all {over}", certificates_as_text(found, options.digits + 2)))
        if box and not all(one.proven for one in found):
            print("more --pieces, or a smaller box, may prove what is undecided")
    return 0 if all(one.proven for one in found) else 1
