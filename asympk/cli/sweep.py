"""``asympk sweep``: a grid or an ensemble of scenes."""

import sys
from argparse import ArgumentParser, Namespace

from asympk.cli.options import whole

HELP = "follow a grid or a random ensemble, chunk by chunk; resumable"


def arguments(parser: ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("file", help="TOML: sigma, mu, start, until, each a number, a grid or random")
    parser.add_argument("--out", required=True, metavar="DIR", help="directory of the chunks; run again to resume")
    parser.add_argument("--workers", type=whole, metavar="N", help="compute in N processes")
    parser.add_argument("--dask", metavar="ADDRESS", help="compute on the dask cluster with this scheduler")


def run(options: Namespace) -> None:
    """Follow the chunks that are missing and print a summary of all."""
    from asympk.sweep import run as follow
    from asympk.sweep.executors import executor
    from asympk.sweep.meter import Meter
    from asympk.sweep.summary import as_text, summarise
    from asympk.sweep.sweepfile import read_sweep

    sweep = read_sweep(options.file)
    meter = Meter(sweep.total, sys.stderr)
    try:
        with executor(options.workers, options.dask) as chosen:
            follow(sweep, options.out, chosen, meter.add)
    finally:
        meter.close()
    print(as_text(summarise(options.out)))
