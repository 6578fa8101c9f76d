"""A formula as source text, to be pasted into a shader or a program."""

from pathlib import Path
from typing import Any

import click

from phongbench.cli.common import JSON, ROOT, show
from phongbench.errors import InputError


@click.command(short_help="A formula as GLSL, HLSL, WGSL or C.")
@click.argument("formula", metavar="[NAME[:form[:gamma]]]", required=False)
@click.option("--alpha", required=True, type=float, metavar="A", help="Exponent of the exact Phong to stand for.")
@click.option("--max-error", metavar="E", help="Without a NAME: the cheapest formula within this error, e.g. 1/255.")
@click.option("--language", metavar="NAME", help="glsl, hlsl, wgsl or c.  [default: by the end of --out, or glsl]")
@click.option("--beta", metavar="POLICY", help="Of the slope.  [default: the formula's first]")
@click.option("--space", metavar="SPACE", help="reflect (R, V) or half (N, H).  [default: the formula's first]")
@click.option(
    "--with", "files", multiple=True, type=click.Path(path_type=Path), metavar="FILE.py", help="Add your own formula."
)
@click.option("--out", type=click.Path(path_type=Path), help="A file.  [default: stdout]")
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
) -> None:
    """Write a formula as a function of two directions, in float32, with its constants filled in.

    It computes what was measured, operation by operation; powers, exponentials and arc cosines are the language's own.

    \b
    Examples:
      phongbench shader lyon:dot:8 --alpha 50
      phongbench shader --alpha 50 --max-error 1/255 --language hlsl
      phongbench shader table-u:cross --alpha 20 --out highlight.c
    """
    from phongbench.formulas.formula import specular_of
    from phongbench.formulas.registry import get
    from phongbench.formulas.shader_code import export
    from phongbench.formulas.spec import Setting
    from phongbench.formulas.user_files import registry_with
    from phongbench.support.atomic_files import write_text, write_whole

    if (formula is None) == (max_error is None):
        raise InputError("a formula is named, or chosen by its error", None, "give either NAME or --max-error")
    if max_error is not None:
        wanted, beta = _recommended(alpha, max_error, space)
    else:
        wanted = specular_of(formula or "")
    spec = get(wanted.approximation, registry_with(files))
    form = wanted.lambda_form or spec.lambda_forms[0]
    language = language or (out.suffix.lstrip(".") if out is not None else "") or "glsl"
    setting = Setting(alpha, wanted.gamma, beta or spec.slopes[0], space or spec.spaces[0])
    found = export.shader(spec, form, setting, language, files=[file.name for file in files])
    if out is not None:
        write_whole(out, lambda path: write_text(path, found.text))
    show({**found.as_dict(), "formula": spec.name}, as_json, lambda: click.echo(out or found.text, nl=out is not None))


def _recommended(alpha: float, max_error: str, space: str | None) -> tuple[Any, str]:
    """The formula and its slope's policy that `recommend` chooses; InputError where nothing is within the error."""
    from phongbench.analysis.recommend import recommend, run_for
    from phongbench.formulas.formula import Specular

    found = recommend(run_for(None, ROOT), alpha=f"{alpha:g}", max_error=max_error, space=space or "reflect")
    if not found["choices"]:
        fix = f"allow more; phongbench recommend --alpha {alpha:g} --max-error {max_error} tells the nearest miss"
        raise InputError("no formula is within this error", "--max-error", fix)
    best = found["choices"][0]
    form = None if best["lambda"] == "none" else best["lambda"]
    return Specular(best["approximation"], form, best["gamma"]), best["beta_policy"]
