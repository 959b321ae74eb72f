"""The command line of asympk; every sub-command imports what it needs, so that --help stays instant."""

import argparse
import os
import re
import sys
from contextlib import suppress

from asympk import __version__

_NEGATIVE = re.compile(r"^-(\d|\.\d)")  # -1/2 and -1e-3 are numbers too, where argparse would see options


def main(arguments=None):
    """Run the command line and return its exit status: 0 done, 1 a claim or check does not hold, 2 bad input."""
    from asympk.errors import AsympkError

    _open_streams()
    options = _parser().parse_args(arguments)
    try:
        return options.run(options) or 0
    except BrokenPipeError:  # whoever read the output has seen enough
        sys.stdout = None
        return 141
    except (AsympkError, OSError) as error:
        if options.debug:
            raise
        _complain(f"asympk: {_one_line(error)}")
        return 2
    except KeyboardInterrupt:
        _complain("asympk: interrupted")
        return 130


def _open_streams():
    """Let output go nowhere where it is closed, so that no file takes its place, and print in any character set."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115 - it stays open
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")


def _complain(line):
    """Print a line on stderr; where that is full or gone the exit status has to do."""
    with suppress(OSError, ValueError):
        print(line, file=sys.stderr, flush=True)


def _one_line(error):
    return " ".join(str(error).split())


class _Parser(argparse.ArgumentParser):
    """An argument parser that reads any negative number as a value, and whose complaint is one line."""

    def __init__(self, *arguments, **options):
        super().__init__(*arguments, **options)
        self._negative_number_matcher = _NEGATIVE

    def error(self, message):
        self.exit(2, f"{self.prog}: {_one_line(message)}; see {self.prog} --help\n")


def _whole(text):
    """Read a whole number; argparse tells what it was."""
    from asympk.numbers import short

    try:
        return int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"invalid int value {short(text)}: it must be a whole number") from None


def _parser():
    parser = _Parser(
        prog="asympk",
        description="Verified asymptotics for the Painlevé-Klein system with dry friction. Without a command: "
        "regenerate derivations, claims and tables, and summarise them.",
    )
    parser.set_defaults(run=_everything, debug=False)
    parser.add_argument("--version", action="version", version=f"asympk {__version__}")
    parser.add_argument("--debug", action="store_true", help="show the traceback of an error")
    _root(parser)
    commands = parser.add_subparsers(title="commands", metavar="COMMAND")

    derive = commands.add_parser("derive", help="run the derivations; write LaTeX, JSON and srepr")
    derive.set_defaults(run=_derive)
    _root(derive)

    claims = commands.add_parser("claims", help="check the paper's claims and print the ledger")
    claims.set_defaults(run=_claims)
    claims.add_argument("id", nargs="*", help="claims to check, such as C16; all by default")
    claims.add_argument("--json", action="store_true", help="print the ledger with all evidence as JSON")

    tables = commands.add_parser("tables", help="write the LaTeX tables and their CSV twins")
    tables.set_defaults(run=_tables)
    _root(tables)

    chart = commands.add_parser("chart", help="run every method on every scene; write what each costs and gets wrong")
    chart.set_defaults(run=_chart)
    chart.add_argument("--quick", action="store_true", help="under a minute, into paper/generated/quick")
    _root(chart)

    paper = commands.add_parser("paper", help="write the figures, tables and numbers of the paper, and its PDF")
    paper.set_defaults(run=_paper)
    paper.add_argument("--only", metavar="PICTURE", help="draw one picture as PDF and SVG, and nothing else")
    _root(paper)

    report = commands.add_parser("report", help="write figures, tables and formulas as one HTML page")
    report.set_defaults(run=_report)
    report.add_argument("--out", required=True, metavar="DIR", help="directory to write index.html into")
    _root(report)

    export = commands.add_parser("export", help="write a stand-alone module of the system's formulas")
    export.set_defaults(run=_export)
    export.add_argument("--target", choices=("c", "python"), required=True)
    export.add_argument("--out", required=True, metavar="DIR", help="directory to write into")

    scenes = commands.add_parser("scenes", help="list the scenes that ship, or print one as TOML")
    scenes.set_defaults(run=_scenes)
    scenes.add_argument("name", nargs="?", help="print this scene's file")

    solve = commands.add_parser("solve", help="follow one scene")
    solve.set_defaults(run=_solve)
    solve.add_argument("scene", nargs="?", help="a scene that ships (asympk scenes), or a TOML file")
    _scene_arguments(solve, required=False)
    solve.add_argument("--physical", action="store_true", help="tell the path in the units of the scene's file")
    solve.add_argument("--csv", metavar="FILE", help="write the path as CSV")
    solve.add_argument("--plot", metavar="FILE", help="draw the path into a .pdf, .svg or .png file")
    solve.add_argument("--method", default="exact", help="exact (default), or another model or integrator")
    solve.add_argument("--digits", type=_whole, help="run on that many digits")
    solve.add_argument("--order", type=_whole, help="order in mu, of the asymptotic models")
    solve.add_argument("--rtol", help="relative tolerance, of the integrators")
    solve.add_argument("--atol", help="absolute tolerance, of the integrators")
    solve.add_argument("--json", action="store_true")

    least = commands.add_parser("least", help="find the least model that a scene needs")
    least.set_defaults(run=_least)
    least.add_argument("scene", nargs="?", help="a scene that ships (asympk scenes), or a TOML file")
    _scene_arguments(least, required=False)
    least.add_argument("--rtol", default="1e-3", help="error allowed, relative to the largest of 1, |x|, |z| (1e-3)")
    least.add_argument("--json", action="store_true")

    sweep = commands.add_parser("sweep", help="follow a grid or a random ensemble, chunk by chunk; resumable")
    sweep.set_defaults(run=_sweep)
    sweep.add_argument("file", help="TOML: a scene in which any number may be a list, a grid or random")
    sweep.add_argument("--out", required=True, metavar="DIR", help="directory of the chunks; run again to resume")
    sweep.add_argument("--plot", metavar="FILE", help="draw the summary into a .pdf, .svg or .png file")
    sweep.add_argument("--workers", type=_whole, metavar="N", help="compute in N processes")
    sweep.add_argument("--dask", metavar="ADDRESS", help="compute on the dask cluster with this scheduler")

    certify = commands.add_parser("certify", help="prove what a scene does, in ball arithmetic")
    certify.set_defaults(run=_certify)
    certify.add_argument("scene", nargs="?", help="a scene that ships, or a TOML file")
    _scene_arguments(certify, required=False)
    certify.add_argument("--box", nargs=3, action="append", metavar=("NAME", "LOW", "HIGH"),
                         help="let sigma, mu, sigma0, x, y, z or until vary; may be repeated")  # fmt: skip
    certify.add_argument("--pieces", type=_whole, default=64, help="cut the box into at most so many pieces (64)")
    certify.add_argument("--digits", type=_whole, default=15, help="digits of the final state (15)")
    certify.add_argument("--claims", action="store_true", help="prove the claims that are inequalities instead")
    certify.add_argument("--json", action="store_true")

    mechanism = commands.add_parser("mechanism", help="tell a mechanism's paradox, and the jump through it")
    mechanism.set_defaults(run=_mechanism)
    mechanism.add_argument("name", nargs="?", help="one of the catalogue (all are listed without it), or a TOML file")
    mechanism.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", help="another number, f=2.5")
    mechanism.add_argument("--plot", metavar="FILE", help="draw the map of rigid motions (.pdf, .svg, .png)")

    bench = commands.add_parser("bench", help="measure speed as ratios in one run")
    bench.set_defaults(run=_bench)
    return parser


def _root(parser):
    parser.add_argument("--root", default=".", metavar="DIR", help="the checkout with derivations/ and paper/ (here)")


def _scene_arguments(parser, required=True):
    parser.add_argument("--sigma", required=required, help="friction parameter f tan(alpha) - 2, above -2")
    parser.add_argument("--mu", required=required, help="compliance, above 0")
    parser.add_argument("--start", required=required, nargs=3, metavar=("X", "Y", "Z"), help="rho, rho', v")
    parser.add_argument("--until", required=required, help="horizon in units of h l")
    parser.add_argument("--sigma0", help="static friction, sigma by default")


def _scene(options):
    from asympk.scene import Scene

    return Scene(options.sigma, options.mu, tuple(options.start), options.until, options.sigma0)


def _scene_file(options):
    """Return the ``SceneFile`` that the options name, their own numbers replacing the file's."""
    from asympk.errors import InputError
    from asympk.scenes.scenefile import SceneFile, changed, load

    numbers = {name: getattr(options, name) for name in ("sigma", "mu", "start", "until", "sigma0")}
    numbers = {name: value for name, value in numbers.items() if value is not None}
    if options.scene is not None:
        found = load(options.scene)
        return SceneFile(changed(found, numbers), found.about)
    missing = [f"--{name}" for name in ("sigma", "mu", "start", "until") if name not in numbers]
    if missing:
        raise InputError(f"a scene, or {', '.join(missing)}, required; asympk scenes lists those that ship")
    return SceneFile(_scene(options))


def _scenes(options):
    from asympk.output.terminal import scenes_as_text
    from asympk.scenes.scenefile import load, names, shipped

    if options.name is not None:
        load(options.name)
    print(scenes_as_text(names()) if options.name is None else shipped(options.name).rstrip())


def _everything(options):
    from asympk.output.regenerate import everything

    with _meter() as meter:
        return everything(options.root, meter.tell)


def _derive(options):
    from asympk.output.regenerate import derive

    with _meter() as meter:
        written = derive(options.root, meter.tell)
    print(f"wrote {len(written)} files under {options.root}/paper/generated")


def _claims(options):
    from asympk.ledger import claim, claims
    from asympk.output.terminal import print_claims

    with _meter("checking claims") as meter:
        found = tuple(map(claim, options.id)) or claims(lambda identifier: meter.tell(f"checking {identifier}"))
    return print_claims(found, options.json, bool(options.id))


def _tables(options):
    from asympk.output.regenerate import write_tables

    with _meter("writing tables"):
        written = write_tables(options.root)
    print(f"wrote {len(written)} files under {options.root}/paper/generated/tables")


def _chart(options):
    from asympk.output.chart import main as chart
    from asympk.output.regenerate import project

    with _meter(log=True) as meter:
        files = chart(options.quick, project(options.root) / "paper" / "generated", meter.tell)
    print(*files, sep="\n")


def _paper(options):
    from asympk.output.paper import build, draw

    with _meter(f"drawing {options.only}") as meter:
        lines = draw(options.root, options.only) if options.only else build(options.root, meter.tell)
    print(*lines, sep="\n")


def _report(options):
    from asympk.output.page import write_page

    with _meter() as meter:
        path = write_page(options.root, options.out, meter.tell)
    print(f"wrote {path}")


def _export(options):
    from asympk.symbolic.export import export
    from asympk.systems import painleve_klein

    for path in export(painleve_klein.system(), options.target, options.out):
        print(path)


def _solve(options):
    from asympk.methods import solve
    from asympk.output.terminal import path_as_json, path_as_text

    given = {name: getattr(options, name) for name in ("digits", "order", "rtol", "atol")}
    given = {name: value for name, value in given.items() if value is not None}
    scene = _scene_file(options).scene
    with _meter("following the scene", log=True) as meter:
        path = solve(scene, options.method, **given, **_reaching(scene, options, meter))
    if options.physical:
        path = path.physical()
    if options.csv:
        path.to_csv(options.csv)
    if options.plot:
        path.plot(options.plot)
    print(path_as_json(path, options.digits) if options.json else path_as_text(path, options.digits))


def _reaching(scene, options, meter):
    """Return the option that tells how far the rod's exact flow with many digits has come; others have none."""
    if not options.digits or options.method != "exact" or scene.system is not None:
        return {}
    return {"progress": lambda t, until, digits: meter.tell(f"t = {t:.6g} of {until:.6g}, with {digits} digits")}


def _least(options):
    from asympk.output.terminal import ladder_as_json, ladder_as_text
    from asympk.studies.least import least_model

    scene = _scene_file(options).scene
    with _meter("climbing the ladder of models"):
        ladder = least_model(scene, options.rtol)
    print(ladder_as_json(ladder) if options.json else ladder_as_text(ladder))


def _sweep(options):
    from asympk.sweep import run
    from asympk.sweep.executors import executor
    from asympk.sweep.summary import as_text, summarise
    from asympk.sweep.sweepfile import read_sweep

    if options.plot:
        from asympk.pictures import sheets

        sheets().suffix_of(options.plot)
    sweep = read_sweep(options.file)
    with _meter(total=sweep.total, log=True) as meter, executor(options.workers, options.dask) as chosen:
        run(sweep, options.out, chosen, meter.add)
    with _meter("summing up", log=True):
        told = summarise(options.out)
    if options.plot:
        from asympk.pictures.spread import plot

        plot(told, options.plot)
    print(as_text(told))


def _certify(options):
    from asympk.errors import InputError
    from asympk.numbers import whole

    scene = (options.scene, options.sigma, options.mu, options.start, options.until, options.sigma0)
    if options.claims and (options.box or any(given is not None for given in scene)):
        raise InputError("certify takes either a scene, with a --box or without, or --claims")
    whole("--digits", options.digits, 1, 300)
    return _prove_claims() if options.claims else _prove_scene(options)


def _prove_claims():
    from asympk.certify.proofs import inequalities, prove
    from asympk.output.terminal import proofs_as_text

    with _meter("proving the inequalities"):
        found = [prove(inequality) for inequality in inequalities()]
    print(proofs_as_text(found))
    return 0 if all(proof.proven for proof in found) else 1


def _prove_scene(options):
    from asympk.certify import certify, cover
    from asympk.output.terminal import certificates_as_json, certificates_as_text

    box = {name: ends for name, *ends in options.box or ()}
    scene = _scene_file(options).scene
    with _meter("proving"):
        found = cover(scene, box, options.pieces) if box else (certify(scene, digits=options.digits),)
    print((certificates_as_json if options.json else certificates_as_text)(found, options.digits + 2))
    return 0 if all(one.proven for one in found) else 1


def _mechanism(options):
    from asympk.output.mechanisms import catalogue_as_text, changes, load, mechanism_as_text

    if options.name is None:
        print(catalogue_as_text())
        return
    described = load(options.name).changed(changes(options.set))
    if options.plot:
        from asympk.pictures import sheets
        from asympk.pictures.motions import motion_plot

        sheet = sheets()
        sheet.suffix_of(options.plot)
        with _meter("drawing"), sheet.in_style():
            sheet.kept(motion_plot(described), options.plot)
        print(f"wrote {options.plot}")
        return
    with _meter("looking for the paradox"):
        lines = mechanism_as_text(described)
    print(lines)


def _bench(options):
    from asympk.studies.bench import main as bench

    return bench()


def _meter(words="", total=None, log=False):
    """Return the ``Meter`` of a job on stderr, a context; ``log`` lets it add lines to a file, too."""
    from asympk.output.meter import Meter

    meter = Meter(sys.stderr, total, log)
    meter.tell(words)
    return meter


if __name__ == "__main__":
    sys.exit(main())
