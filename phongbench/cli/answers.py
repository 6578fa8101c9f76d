"""What a run answers: the front, and the textbook claims."""

from functools import partial
from typing import Any

import click

from phongbench.cli.common import JSON, ROOT, CommaList, show
from phongbench.errors import InputError

ALPHA_HELP = "One exponent, several (10,50,200) or a range (10..200)."
TARGET = click.option(
    "--target",
    "targets",
    type=CommaList("names"),
    default="cpu",
    show_default=True,
    help="Where it will run, e.g. rdna2,gcn4; see `phongbench targets`.",
)
SHORT_OF = click.option("--short-of", metavar="UNIT", help="What that shader lacks: issue or special.")
SPACE_HELP = "reflect (R, V), or half (N, H), judged over all configurations of N, L and V."


def one_or_all(answers: list[dict[str, Any]]) -> dict[str, Any]:
    """The only answer, or all of them by target; InputError where there is none."""
    if not answers:
        raise InputError("no target is named", "--target", "leave it out for this machine")
    return answers[0] if len(answers) == 1 else {"targets": {answer["target"]: answer for answer in answers}}


@click.command(short_help="The error/time front of a run.")
@click.argument("run_name", metavar="RUN")
@click.option("--alpha", required=True, metavar="A", help=ALPHA_HELP)
@click.option("--metric", default="max_abs", show_default=True, help="Column of the accuracy rows.")
@click.option("--stratum", help="Which inputs.  [default: highlight; of (N, H) configurations]")
@click.option(
    "--precision", default="float32", show_default=True, help="float16, bfloat16, float32, float64, q1.15, ..."
)
@click.option("--working-set", default="l1", show_default=True, help="Whose times: l1, l2 or memory.")
@click.option("--space", default="reflect", show_default=True, help=SPACE_HELP)
@TARGET
@SHORT_OF
@click.option("--all", "everything", is_flag=True, help="Show the cells that are off the front too.")
@JSON
def front(run_name: str, everything: bool, as_json: bool, targets: tuple[str, ...], **options: Any) -> None:
    """Show which formulas no other one beats in both error and time.

    Over several exponents a formula's error is its worst. A formula is `unresolved` where the intervals of the times
    do not tell whether it is beaten.

    \b
    Examples:
      phongbench front latest --alpha 50
      phongbench front latest --alpha 10..200 --metric rms --working-set memory
    """
    from phongbench.cli.answer_tables import front_table
    from phongbench.results import runs
    from phongbench.results.answering import kept

    run = runs.find(run_name, ROOT)
    answers = [kept(run, ROOT, _points, target=target, **options) for target in dict.fromkeys(targets)]
    show(one_or_all(answers), as_json, *(partial(front_table, answer, everything=everything) for answer in answers))


def _points(run: Any, **question: Any) -> dict[str, Any]:
    """The front of a run, where it is not kept."""
    from phongbench.analysis.front import points

    return points(run, **question)


@click.command(short_help="Judge the textbook claims by a run.")
@click.argument("run_name", metavar="RUN")
@click.option("--verbose", is_flag=True, help="The whole reason of each verdict.")
@JSON
def claims(run_name: str, verbose: bool, as_json: bool) -> None:
    """Judge the textbook claims by the rows of a run.

    Each claim holds, holds under conditions, fails, or was not measured, by a stated rule; --json has the rules, all
    conditions as numbers and the rows that decide. What was not measured says which flags measure it.

    \b
    Examples:
      phongbench claims latest
      phongbench claims latest --json
    """
    from phongbench.analysis.claims import answer
    from phongbench.cli.answer_tables import claims_table
    from phongbench.results import runs

    judged = answer(runs.find(run_name, ROOT))
    show(judged, as_json, lambda: claims_table(judged, verbose=verbose))
