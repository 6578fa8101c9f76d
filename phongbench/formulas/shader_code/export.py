"""A formula as source text for a shader or a C program: what was measured, ready to be pasted."""

import shlex
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from phongbench import __version__
from phongbench.compiler.precisions import FLOAT32
from phongbench.formulas import lambda_forms
from phongbench.formulas.curves import lobe
from phongbench.formulas.formula import Formula, Registry
from phongbench.formulas.kernel import known_values, needs_gate
from phongbench.formulas.recipes import PAIR
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.shader_code.languages import LANGUAGES, language_named
from phongbench.formulas.shader_code.printer import Speller
from phongbench.formulas.shader_code.raw_vectors import Prepared, arguments, prepared
from phongbench.formulas.spec import Approximation, Setting

__all__ = ["ANGLES", "LANGUAGES", "Shader", "language_named", "shader"]

#: angles at which the largest error is looked for; their squares are evenly spaced, since highlights are narrow
ANGLES = 16_384
#: lambda form -> the variables that lead to it, from directions {a} and {b} and their cosine; as in lambda_forms.py
_FORMS: dict[str, tuple[tuple[str, str, str], ...]] = {
    "none": (),
    "dot": (("float", "cosine_deficit", "1.0 - cosine"),),
    "difference": (("direction", "d", "{a} - {b}"), ("float", "cosine_deficit", "0.5 * dot(d, d)")),
    "cross": (("direction", "c", "cross({a}, {b})"), ("float", "cosine_deficit", "0.5 * dot(c, c)")),
    "tan2": (("direction", "c", "cross({a}, {b})"), ("float", "cosine_deficit", "0.5 * dot(c, c) / (cosine * cosine)")),
}
#: space -> the names of both directions, and what they are
_DIRECTIONS = {
    "reflect": ("r", "v", "r is the light's direction mirrored at the normal, v points to the viewer"),
    "half": ("n", "h", "n is the normal, h the direction half way between light and viewer"),
}
_FROM_N_L_V = "n is the normal, l points to the light, v to the viewer; of any length where the formula removes lengths"


@dataclass(frozen=True)
class Shader:
    """A formula in a language.

    text       its source: functions, the last of which is `highlight`, of two directions
    max_error  its largest error against exact Phong on unit vectors up to 90 degrees, at ANGLES angles, in float32
    bound      what no pair of directions made unit in float32 errs beyond; None where nothing is promised
    """

    language: str
    text: str
    max_error: float
    bound: float | None = None

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {"language": self.language, "text": self.text, "max_error": self.max_error, "bound": self.bound}


def shader(
    formula: Formula,
    alpha: float,
    language: str = "glsl",
    *,
    files: Iterable[str] = (),
    registry: Registry = REGISTRY,
    bound: float | None = None,
) -> Shader:
    """The source of a function `highlight` of two directions, and of what it calls.

    formula, alpha  what it computes
    language        one of LANGUAGES
    files           names of files that added the user's own formulas, for the command in the comment at the top
    registry        the approximations that the formula may name
    bound           what the comment at the top may promise; without it, it tells samples and promises nothing
    returns         Shader; float32 throughout. It computes what the kernels compute, operation by operation, but for
                    powers, exponentials, roots and arc cosines, which are the language's own
    Raises UnknownNameError or InputError for what does not exist, KernelError for a body that has no spelling.
    """
    chosen = language_named(language)
    formula.check(alpha, registry)
    spec, setting = formula.spec(registry), formula.setting(alpha)
    error = _largest_error(spec, formula, setting)
    table = None if spec.table is None else spec.table(setting)
    speller = Speller(chosen, table)
    entry = _entry(speller, spec, formula, setting)
    made_by = _command(formula.spelled(registry), alpha, chosen.name, files)
    parts = [_head(spec, formula, alpha, _error(spec, formula, error, bound), made_by)]
    parts += [chosen.preamble] if chosen.preamble else []
    if table is not None:
        parts.append(chosen.listed("TABLE", [chosen.number(float(value)) for value in table]))
    return Shader(chosen.name, "\n\n".join([*parts, *speller.functions, entry]) + "\n", error, bound)


def _largest_error(spec: Approximation, formula: Formula, setting: Setting) -> float:
    degrees = 90.0 * np.linspace(0.0, 1.0, ANGLES) ** 2
    value, exact = lobe(spec, formula.lambda_form, setting, degrees, precision=FLOAT32, normalise=formula.normalise)
    return float(np.abs(value - exact).max())


def _command(spelling: str, alpha: float, language: str, files: Iterable[str]) -> str:
    """The command that makes the same again."""
    words = ["phongbench", "shader", spelling, "--alpha", repr(alpha).removesuffix(".0")]
    words += [word for file in files for word in ("--with", file)]
    return shlex.join([*words, "--language", language])


def _error(spec: Approximation, formula: Formula, sampled: float, bound: float | None) -> str:
    """What is promised of the error, or what was sampled."""
    if bound is None:
        plane = " of coplanar vectors" if formula.recipe == "halfway" else ""
        return f"largest error against exact Phong at {ANGLES} angles{plane}: {sampled:.3g}; sampled, not promised"
    terms = " if powers and arcs err by at most 1e-6" if spec.cost.transcendentals else ""
    plane = "coplanar directions" if formula.space == "half" else "directions"
    where = "on vectors of lengths from 0.001 to 1000" if formula.raw else f"on {plane} made unit in float32"
    most = f"errs by at most {bound:.3g}, {255 * bound:.2g} of 255, {where}: proven{terms}"
    return f"{most}; {sampled:.3g} was sampled"


def _head(spec: Approximation, formula: Formula, alpha: float, error: str, made_by: str) -> str:
    words = [f"alpha = {alpha:g}"]
    words += [f"gamma = {formula.gamma}"] if formula.gamma is not None else []
    words += [f"lambda form {formula.lambda_form}"] if formula.lambda_form != "none" else []
    words += [f"slope {formula.slope}"] if formula.slope != "none" else []
    lines = [
        f"{spec.title}: {spec.formula}",
        ", ".join(words),
        error,
        _DIRECTIONS[formula.space][2] if formula.recipe == PAIR else _FROM_N_L_V,
        spec.source.citation,
        f"phongbench {__version__}: {made_by}",
    ]
    return "\n".join(f"// {line}" for line in lines)


def _entry(speller: Speller, spec: Approximation, formula: Formula, setting: Setting) -> str:
    """The function `highlight`."""
    language, form, pair = speller.language, formula.lambda_form, _DIRECTIONS[setting.space][:2]
    gated, made = needs_gate(spec, form, setting), prepared(speller, formula, pair)
    lines = made.lines + _coordinates(speller, form, made, gated=gated)
    kernel = speller.function(spec.kernel, **dict(known_values(spec, setting)))
    numbers = dict(spec.coefficients(setting))
    coordinate = "cosine_deficit" if form != "none" else "ratio" if made.coordinate else "cosine"
    value = f"{kernel}({', '.join([coordinate, *(language.number(numbers[name]) for name in spec.scalars)])})"
    dark = language.number(0.0)
    lines.append(f"return {language.chosen(f'cosine > {dark}', value, dark) if gated else value};")
    kind, name = language.direction
    taken = [(kind, name.format(direction)) for direction in arguments(formula, pair)]
    header = language.header(language.float_type, "highlight", taken)
    return "\n".join([f"{header} {{", *(f"    {line}" for line in lines), "}"])


def _coordinates(speller: Speller, form: str, made: Prepared, *, gated: bool) -> list[str]:
    """Statements that make `cosine` and `cosine_deficit`: by the language's vectors, or component by component.

    Of a pair that is treated as a whole `cosine` is its product as it is, and its cosine or the square `ratio`.
    """
    language, a, b = speller.language, made.a, made.b
    if made.coordinate:
        name = "ratio" if form == "none" else "cosine_deficit"
        whole = [language.declared(language.float_type, name, made.coordinate)]
        return [*_coordinates(speller, "none", Prepared(a, b), gated=True), *whole] if gated else whole
    if language.components:
        given = ", ".join([a + c for c in language.components] + [b + c for c in language.components])
        bodies = {"cosine": lambda_forms.dot} if gated or form == "none" else {}
        bodies |= {"cosine_deficit": lambda_forms.LAMBDA_FORMS[form]} if form != "none" else {}
        return [
            language.declared(language.float_type, name, f"{speller.function(body)}({given})")
            for name, body in bodies.items()
        ]
    kinds = {"float": language.float_type, "direction": language.direction[0]}
    cosine = (("float", "cosine", "dot({a}, {b})"),) if gated or form in ("none", "dot", "tan2") else ()
    return [language.declared(kinds[kind], name, text.format(a=a, b=b)) for kind, name, text in cosine + _FORMS[form]]
