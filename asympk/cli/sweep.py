"""``asympk sweep``: a grid or an ensemble of scenes."""

from argparse import ArgumentParser, Namespace

from asympk.cli.options import meter, place_name, require_drawable, whole_number

HELP = "follow a grid or a random ensemble of scenes in chunks; a run that was interrupted resumes"


def arguments(parser: ArgumentParser) -> None:
    parser.add_argument("file", help="TOML: a scene in which any number may be a list, a grid or random")
    parser.add_argument("--out", type=place_name, required=True, metavar="DIR",
                        help="directory of the chunks; the same command resumes")
    parser.add_argument("--plot", type=place_name, metavar="FILE", help="draw the summary (.pdf, .svg, .png)")
    parser.add_argument("--workers", type=whole_number, metavar="N", help="compute in N processes")
    parser.add_argument("--dask", metavar="ADDRESS", help="compute on the dask cluster with this scheduler")


def run(options: Namespace) -> None:
    """Follow the chunks that are missing and print a summary of all."""
    from asympk.output.terminal import sweep_as_text
    from asympk.sweep import run_sweep as follow
    from asympk.sweep.executors import executor
    from asympk.sweep.summary import summarise
    from asympk.sweep.sweepfile import read_sweep

    require_drawable(options.plot)
    sweep = read_sweep(options.file)
    with meter(total=sweep.total, log=True) as shown, executor(options.workers, options.dask) as chosen:
        follow(sweep, options.out, chosen, shown.add)
    with meter("summing up", log=True):
        summary = summarise(options.out)
    if options.plot:
        from asympk.pictures.spread import plot

        plot(summary, options.plot)
    print(sweep_as_text(summary))
