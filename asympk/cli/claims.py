"""``asympk claims``: the ledger of the paper's claims."""

from argparse import ArgumentParser, Namespace

from asympk.cli.options import meter

HELP = "check the paper's claims and print the ledger"


def arguments(parser: ArgumentParser) -> None:
    parser.add_argument("id", nargs="*", help="claims to print with their evidence, such as C16 (all, a line each)")
    parser.add_argument("--json", action="store_true", help="print the ledger with all evidence as JSON")


def run(options: Namespace) -> int:
    """Print the ledger, or the evidence of chosen claims; returns 1 where a claim is not settled."""
    from asympk.ledger import claim_called, claims
    from asympk.output.terminal import print_claims

    with meter("checking claims") as shown:
        named = tuple(dict.fromkeys(map(claim_called, options.id)))
        found = named or claims(lambda identifier: shown.tell(f"checking {identifier}"))
    return print_claims(found, options.json, bool(options.id))
