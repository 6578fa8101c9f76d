"""A formula as source text, to be pasted into a shader or a program."""

from pathlib import Path
from typing import Any

import click

from phongbench.cli.common import JSON, PATH, ROOT, WITH, CommaList, show
from phongbench.errors import InputError


@click.command(short_help="A formula as GLSL, HLSL, WGSL, Metal, ESSL, C, CUDA or NumPy.")
@click.argument("formula", metavar="[FORMULA]", required=False)
@click.option("--alpha", required=True, type=float, metavar="A", help="Exponent of the exact Phong to stand for.")
@click.option("--max-error", metavar="E", help="Without a FORMULA: the cheapest formula within this error, e.g. 1/255.")
@click.option(
    "--language",
    metavar="NAME",
    help="glsl, hlsl, wgsl, metal, c, essl100, essl300, cuda or numpy.  [default: by the end of --out, or glsl]",
)
@click.option(
    "--precision",
    default="float32",
    show_default=True,
    help="float16 or mediump too, where the language has it; the error told is measured in it.",
)
@click.option("--beta", metavar="POLICY", help="Of the slope, instead of the FORMULA's.")
@click.option("--space", metavar="SPACE", help="reflect (R, V) or half (N, H), instead of the FORMULA's.")
@click.option(
    "--over-long",
    default="clamp",
    show_default=True,
    metavar="clamp|keep",
    help="Whether vectors longer than 1 give no more than 1 on GPUs, or what the formula says.",
)
@click.option("--length-error", default="0", metavar="E", help="Lengths may be wrong by this: 0.01 is up to 1 %.")
@click.option("--target", "targets", type=CommaList("names"), default="", help="Tell the cost on these, e.g. rdna2.")
@WITH
@click.option("--out", type=PATH, help="A file.  [default: stdout]")
@JSON
def shader(
    formula: str | None,
    alpha: float,
    max_error: str | None,
    language: str | None,
    beta: str | None,
    space: str | None,
    files: tuple[Path, ...],
    out: Path | None,
    as_json: bool,
    length_error: str,
    **options: Any,
) -> None:
    """Write a formula as a function of two directions, or of n, l and v, with its constants filled in.

    FORMULA is NAME[:FORM][:GAMMA][:SLOPE][@RECIPE]. The code computes what was measured, its constants folded; powers,
    exponentials and arc cosines are the language's own. On GPUs it takes no more instructions than by hand.

    \b
    Examples:
      phongbench shader lyon:dot:8 --alpha 50
      phongbench shader lyon:dot:32:minimax --alpha 50 --target rdna2,gcn4
      phongbench shader --alpha 50 --max-error 1/255 --language hlsl
      phongbench shader gaussian:dot --alpha 50 --language essl300 --precision mediump
      phongbench shader table-u:cross --alpha 20 --out highlight.c
    """
    from phongbench.analysis.error_budget import number
    from phongbench.analysis.ready_code import ready_code
    from phongbench.formulas.formula import Formula
    from phongbench.formulas.shader_code.export import Options
    from phongbench.formulas.shader_code.languages import language_of_file
    from phongbench.formulas.user_files import registry_with
    from phongbench.support.atomic_files import write_text, write_whole

    registry = registry_with(files)
    if formula is not None and max_error is None:
        named = Formula.parse(formula, registry)
    elif formula is None and max_error is not None:
        named = _recommended(alpha, max_error, space)
    else:
        raise InputError("a formula is named, or chosen by its error", None, "give either FORMULA or --max-error")
    parts = named.approximation, named.lambda_form, named.gamma
    slope, pair = beta or named.slope, space or named.space
    wanted = Formula.of(*parts, slope, pair, recipe=named.recipe, normalise=named.normalise, registry=registry)
    language = language or language_of_file("" if out is None else out.suffix.lstrip(".")) or "glsl"
    own = tuple(file.name for file in files)
    wrong = number(length_error, "--length-error")
    code = ready_code(wanted, alpha, Options(language, length_error=wrong, files=own, **options), registry)
    if out is not None:
        write_whole(out, lambda path: write_text(path, code.text))
    answer = {**code.as_dict(), "formula": wanted.approximation, "name": wanted.spelled(registry)}
    show(answer, as_json, lambda: click.echo(out or code.text, nl=out is not None))


def _recommended(alpha: float, max_error: str, space: str | None) -> Any:
    """The formula that `recommend` chooses; InputError where nothing is within the error."""
    from phongbench.analysis.recommend import recommend
    from phongbench.formulas.formula import Formula
    from phongbench.results.answering import run_for

    advice = recommend(run_for(None, ROOT), alpha=f"{alpha:g}", max_error=max_error, space=space or "reflect")
    if not advice["choices"]:
        fix = f"allow more; phongbench recommend --alpha {alpha:g} --max-error {max_error} tells the nearest miss"
        raise InputError("no formula is within this error", "--max-error", fix)
    best = advice["choices"][0]
    return Formula.of(best["approximation"], best["lambda"], best["gamma"], best["beta_policy"], advice["space"])
