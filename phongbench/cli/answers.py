"""What a run answers, and how fast we are.

The front, the formula for a budget, the textbook claims, the comparison with peers.
"""

import sys
from functools import partial
from typing import Any

import click

from phongbench.cli.common import DIFFERENT, JSON, ROOT, CommaList, show
from phongbench.errors import InputError

_ALPHA = "One exponent, several (10,50,200) or a range (10..200)."
TARGET = click.option(
    "--target",
    "targets",
    type=CommaList("names"),
    default="cpu",
    show_default=True,
    help="Where it will run, e.g. rdna2,gcn4; see `phongbench targets`.",
)
SHORT_OF = click.option("--short-of", metavar="UNIT", help="What that shader lacks: issue or special.")
_SPACE = "reflect (R, V), or half (N, H), judged over all configurations of N, L and V."


def one_or_all(answers: list[dict[str, Any]]) -> dict[str, Any]:
    """The only answer, or all of them by target; InputError where there is none."""
    if not answers:
        raise InputError("no target is named", "--target", "leave it out for this machine")
    return answers[0] if len(answers) == 1 else {"targets": {answer["target"]: answer for answer in answers}}


@click.command(short_help="The error/time front of a run.")
@click.argument("run_name", metavar="RUN")
@click.option("--alpha", required=True, metavar="A", help=_ALPHA)
@click.option("--metric", default="max_abs", show_default=True, help="Column of the accuracy rows.")
@click.option("--stratum", help="Which inputs.  [default: highlight; of (N, H) configurations]")
@click.option(
    "--precision", default="float32", show_default=True, help="float16, bfloat16, float32, float64, q1.15, ..."
)
@click.option("--working-set", default="l1", show_default=True, help="Whose times: l1, l2 or memory.")
@click.option("--space", default="reflect", show_default=True, help=_SPACE)
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
    from phongbench.analysis.front import points
    from phongbench.cli.terminal import front_table
    from phongbench.results import runs

    run = runs.find(run_name, ROOT)
    answers = [points(run, target=target, root=ROOT, **options) for target in dict.fromkeys(targets)]
    show(one_or_all(answers), as_json, *(partial(front_table, answer, everything=everything) for answer in answers))


@click.command(short_help="The cheapest formula within an error budget.")
@click.option("--alpha", required=True, metavar="A", help=_ALPHA)
@click.option("--max-error", metavar="E", help="Largest absolute error allowed, e.g. 0.004 or 1/255.")
@click.option("--inverse-error", metavar="DEGREES", help="How far normals may be off that it gives back from pictures.")
@click.option("--run", "run_name", metavar="RUN", help="Which run answers.  [default: the newest with times]")
@click.option("--length-error", metavar="e", help="How wrong vector lengths may be: 0.01 is up to 1 %.")
@click.option("--mesh-angle", metavar="DEGREES", help="Instead: between the normals at the ends of a mesh's edge.")
@click.option("--contract", is_flag=True, help="Within on every device that keeps WGSL's and Vulkan's accuracies.")
@click.option("--raw", is_flag=True, help="Choose among recipes from N, L and V; of any length without --length-error.")
@click.option(
    "--precision", default="float32", show_default=True, help="float16, bfloat16, float32, float64, q1.15, ..."
)
@click.option("--space", default="reflect", show_default=True, help=_SPACE)
@click.option("--working-set", default="l1", show_default=True, help="Whose times: l1, l2 or memory.")
@TARGET
@SHORT_OF
@JSON
def recommend(run_name: str | None, as_json: bool, targets: tuple[str, ...], **options: Any) -> None:
    """Name the cheapest formula whose largest error stays within a budget, and say why.

    Within is a promise: the bound is proven for all pairs of vectors made unit in the working precision, as shaders do
    it, or of a formula that cannot be proven searched and widened. What was only sampled decides nothing. With
    --contract it is proven of the code that `phongbench shader` writes, on any device that keeps what the standards of
    WGSL and Vulkan allow it to err.

    The newest run with times answers; where there is none, the closed-form laws do, and say so. Formulas of (N, H) are
    left out unless --space half asks for them: they are another lobe than Phong's, and err by most of it at grazing
    incidence. Exit 1 if nothing meets the budget.

    \b
    Examples:
      phongbench recommend --alpha 50 --max-error 1/255
      phongbench recommend --alpha 10..200 --max-error 0.02 --length-error 0.01
      phongbench recommend --alpha 50 --max-error 1/255 --raw
      phongbench recommend --alpha 50 --max-error 1/100 --target rdna2,gcn4
      phongbench recommend --alpha 50 --max-error 1/255 --contract
    """
    from phongbench.analysis.recommend import elsewhere, recommend, run_for
    from phongbench.cli.terminal import recommendation

    if options["max_error"] is None:
        if options["inverse_error"] is None:
            raise click.UsageError("Missing option '--max-error'.")
        options["max_error"] = 1
    run = run_for(run_name, ROOT)
    answers = [recommend(run, target=target, root=ROOT, **options) for target in dict.fromkeys(targets)]
    if targets == ("cpu",):
        options.pop("short_of")
        answers[0]["elsewhere"] = elsewhere(run, answers[0], **options)
    show(one_or_all(answers), as_json, *(partial(recommendation, answer) for answer in answers))
    if not all(answer["choices"] for answer in answers):
        sys.exit(DIFFERENT)


@click.command(short_help="Judge the textbook claims by a run.")
@click.argument("run_name", metavar="RUN")
@JSON
def claims(run_name: str, as_json: bool) -> None:
    """Judge the textbook claims by the rows of a run.

    Each claim holds, holds under conditions, fails, or was not measured, by a stated rule; --json has the rules, all
    conditions as numbers and the rows that decide. What was not measured says which flags measure it.

    \b
    Examples:
      phongbench claims latest
      phongbench claims latest --json
    """
    from phongbench.analysis.claims import answer
    from phongbench.cli.terminal import claims_table
    from phongbench.results import runs

    judged = answer(runs.find(run_name, ROOT))
    show(judged, as_json, lambda: claims_table(judged))


@click.command(short_help="Time our kernels against NumPy, numexpr, JAX, PyTorch, Taichi and C.")
@click.option("--peers", "names", type=CommaList("names"), help="numpy,numexpr,jax,torch,taichi,c  [default: all]")
@click.option("--budget", type=float, default=10.0, show_default=True, metavar="SECONDS", help="For the rounds.")
@JSON
def bench(names: tuple[str, ...] | None, budget: float, as_json: bool) -> None:
    """Time the same work, exact Phong and Lyon gamma 8 in float32, by our kernels and by every installed peer.

    Beside loops written by hand in C, compiled here, a Gaussian and Lyon's cross form are timed too.

    All run interleaved on one thread over the same vectors, one Python call a pass, and their results are checked.
    Peers that are not installed are said to be absent; the extra `peers` brings them. The sweep's throughput against
    plain NumPy is measured too.
    """
    from phongbench.benchmarks.kernel_bench import bench
    from phongbench.cli.terminal import TerminalProgress, bench_tables

    with TerminalProgress(quiet=as_json) as progress:
        answer = bench(names, budget_seconds=budget, progress=progress)
    show(answer, as_json, lambda: bench_tables(answer))
