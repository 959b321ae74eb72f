"""``asympk claims``: the ledger of the paper's claims."""

from argparse import ArgumentParser, Namespace

HELP = "check the paper's claims and print the ledger"


def arguments(parser: ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("id", nargs="*", help="claims to check, such as C16; all by default")
    parser.add_argument("--json", action="store_true", help="print the ledger with all evidence as JSON")


def run(options: Namespace) -> int:
    """Print the ledger, or the evidence of chosen claims; returns 1 where a claim is not settled."""
    from asympk.output.terminal import print_claims

    return print_claims(options.id, options.json)
