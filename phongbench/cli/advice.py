"""What to ship for an error budget: at exponents, or for the materials of a file; and the code of the choice."""

import sys
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

import click

from phongbench.cli.answers import ALPHA_HELP, SHORT_OF, SPACE_HELP, TARGET, one_or_all
from phongbench.cli.common import DIFFERENT, JSON, PATH, ROOT, notes, show
from phongbench.errors import PhongbenchError

#: what of a command line is no part of the question: who answers, where, and how it is shown
_SHOWN = ("run_name", "as_json", "targets", "materials", "language")


@click.command(short_help="The cheapest formula within an error budget.")
@click.option("--alpha", metavar="A", help=ALPHA_HELP)
@click.option("--materials", type=PATH, metavar="FILE.mtl", help="Instead: an answer for each of its materials.")
@click.option("--max-error", metavar="E", help="Largest absolute error allowed, e.g. 0.004 or 1/255.")
@click.option("--inverse-error", metavar="DEGREES", help="How far normals may be off that it gives back from pictures.")
@click.option("--run", "run_name", metavar="RUN", help="Which run answers.  [default: the newest with times]")
@click.option("--length-error", metavar="e", help="How wrong vector lengths may be: 0.01 is up to 1 %.")
@click.option("--mesh-angle", metavar="DEGREES", help="Instead: between the normals at the ends of a mesh's edge.")
@click.option("--inputs", default="vectors", show_default=True, help="vectors, or cosine where only R.V is at hand.")
@click.option("--contract", is_flag=True, help="Within on every device that keeps WGSL's and Vulkan's accuracies.")
@click.option("--raw", is_flag=True, help="Choose among recipes from N, L and V; of any length without --length-error.")
@click.option(
    "--precision", default="float32", show_default=True, help="float16, bfloat16, float32, float64, q1.15, ..."
)
@click.option("--space", default="reflect", show_default=True, help=SPACE_HELP)
@click.option("--working-set", default="l1", show_default=True, help="Whose times: l1, l2 or memory.")
@TARGET
@SHORT_OF
@click.option("--code", "language", metavar="NAME", help="Print the choice in a language, too: glsl, hlsl, wgsl, c, ..")
@JSON
def recommend(
    run_name: str | None,
    as_json: bool,
    targets: tuple[str, ...],
    materials: Path | None,
    language: str | None,
    **options: Any,
) -> None:
    """Name the cheapest formula whose largest error stays within a budget, and say why.

    Within is a promise: the bound is proven for all pairs of vectors made unit in the working precision, as shaders do
    it, or of a formula that cannot be proven searched and widened. What was only sampled decides nothing. With
    --contract it is proven of the code that `phongbench shader` writes, on any device that keeps what the standards of
    WGSL and Vulkan allow it to err. Of formulas whose times are tied the most accurate one is named; where the best is
    not surely faster than exact Phong, that is the answer.

    The newest run with times answers; where there is none, the closed-form laws do, and say so. Formulas of (N, H) are
    left out unless --space half asks for them: they are another lobe than Phong's, and err by most of it at grazing
    incidence. Over several exponents one formula is chosen for all. Exit 1 if nothing meets the budget.

    \b
    Examples:
      phongbench recommend --alpha 50 --max-error 1/255
      phongbench recommend --alpha 10..200 --max-error 0.02 --length-error 0.01
      phongbench recommend --materials scene.mtl --max-error 1/255 --code glsl
      phongbench recommend --alpha 20 --max-error 1/255 --inputs cosine --precision float16
      phongbench recommend --alpha 50 --max-error 1/255 --raw
      phongbench recommend --alpha 50 --max-error 1/100 --target rdna2,gcn4
      phongbench recommend --alpha 50 --max-error 1/255 --contract
    """
    from phongbench.cli.answer_tables import material_table, print_codes, recommendation
    from phongbench.results.answering import kept, run_for

    if options["max_error"] is None:
        if options["inverse_error"] is None:
            raise click.UsageError("Missing option '--max-error'.")
        options["max_error"] = 1
    if (options["alpha"] is None) == (materials is None):
        raise click.UsageError("Missing option '--alpha'." if materials is None else "give --alpha or --materials")
    run, distinct = run_for(run_name, ROOT), tuple(dict.fromkeys(targets))
    if materials is not None:
        from phongbench.analysis.material_advice import for_materials

        del options["alpha"]
        document = for_materials(run, materials, distinct, root=ROOT, **options)
        answers, parts = document["materials"], [partial(material_table, document)]
        notes(document["notes"], quiet=as_json)
    else:
        alone = targets == ("cpu",)
        answers = [kept(run, ROOT, _advice, beside_others=alone, target=target, **options) for target in distinct]
        document, parts = one_or_all(answers), [partial(recommendation, answer) for answer in answers]
    if language is not None:
        from phongbench.analysis.ready_code import codes_of

        for answer in answers:
            answer["codes"] = codes_of(answer, language)
        parts.append(partial(print_codes, answers))
    show(document, as_json, *parts)
    if not all(answer["choices"] for answer in answers):
        sys.exit(DIFFERENT)


def answer_ahead(run: Any, words: list[str]) -> None:
    """Keep the answer to a recommendation, given as its command line has it, before it is asked; say nothing."""
    from phongbench.results.answering import kept

    asked = recommend.make_context("recommend", words).params
    question = {name: value for name, value in asked.items() if name not in _SHOWN}
    with suppress(PhongbenchError):
        kept(run, ROOT, _advice, beside_others=True, target="cpu", **question)


def _advice(run: Any, *, beside_others: bool, **question: Any) -> dict[str, Any]:
    """The answer of a run, where it is not kept; beside_others: with the other answers on compiled targets."""
    from phongbench.analysis.recommend import recommend

    return recommend(run, others=beside_others, **question)
