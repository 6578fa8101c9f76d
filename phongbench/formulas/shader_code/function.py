"""The function `highlight` of a formula in a language: from directions to a coordinate, the kernel, and a gate.

The gate `cosine > 0` is written where light would leak past 90 degrees otherwise, and nowhere else.
"""

import math
import re
from dataclasses import replace

from phongbench.formulas import lambda_forms
from phongbench.formulas.kernel import known_values, needs_gate
from phongbench.formulas.shader_code.languages import Language
from phongbench.formulas.shader_code.values import Affine, Term, Value
from phongbench.formulas.shader_code.writer import Writer
from phongbench.formulas.spec import Approximation, Setting

#: space -> the names of both directions, and what they are
DIRECTIONS = {
    "reflect": ("r", "v", "r is the light's direction mirrored at the normal, v points to the viewer"),
    "half": ("n", "h", "n is the normal, h the direction half way between light and viewer"),
}
#: lambda form -> (type, name, expression) of the variables that lead to a quantity, from directions {a} and {b}, and by
#: how much lambda is a multiple of the last one; as in lambda_forms.py
_FORMS: dict[str, tuple[tuple[tuple[str, str, str], ...], float]] = {
    "difference": ((("direction", "d", "{a} - {b}"), ("float", "squared_distance", "dot(d, d)")), 0.5),
    "cross": ((("direction", "c", "cross({a}, {b})"), ("float", "squared_sine", "dot(c, c)")), 0.5),
    "tan2": (
        (("direction", "c", "cross({a}, {b})"), ("float", "squared_tangent", "dot(c, c) / (cosine * cosine)")),
        0.5,
    ),
}
#: what nobody sees: half a step of float32 at 1, and the least half of a subnormal float16
INVISIBLE = 2.0**-25


def written(spec: Approximation, form: str, setting: Setting, language: Language, *, limited: bool = True) -> str:
    """The function, and what the language needs in front of it.

    limited  whether over-long vectors give no more than 1, on GPUs; else as much as the formula says
    """
    table = None if spec.table is None else spec.table(setting)
    gated = not dark_behind(spec, form, setting, language)
    writer, value = _body(spec, form, setting, Writer(language, table, limited=limited), gated=gated)
    if limited and language.gpu and form in ("none", "dot") and not _limits_itself(writer, value):
        writer, value = _body(spec, form, setting, Writer(language, table, limited=limited), gated=gated, unit=True)
    if gated:
        value = writer.named("value", value)
        dark = writer.term(0.0).text
        value = Term(language.chosen(f"cosine > {dark}", writer.term(value).text, dark))
    lines = [*writer.lines, language.returned(writer.term(value).text)]
    kind, name = language.direction
    a, b, _ = DIRECTIONS[setting.space]
    header = language.header(language.float_type, "highlight", [(kind, name.format(a)), (kind, name.format(b))])
    parts = [language.preamble] if language.preamble else []
    if table is not None:
        parts.append(language.listed("TABLE", [language.number(float(entry)) for entry in table]))
    return "\n\n".join([*parts, *writer.helpers.values(), language.function(header, lines)])


def dark_behind(spec: Approximation, form: str, setting: Setting, language: Language) -> bool:
    """Whether nobody sees what the code gives where a.b is not positive, without a gate.

    So it is where the kernel needs none, and where its value falls from the peak and has vanished at 90 degrees: on
    GPUs below INVISIBLE, elsewhere to 0, NaN included.
    """
    if not needs_gate(spec, form, setting):
        return True
    if form not in ("none", "dot") or not spec.falls:
        return False
    value = spec.bound(setting)
    try:
        behind, nowhere = abs(float(value(0.0 if form == "none" else 1.0))), float(value(math.nan))
    except (ArithmeticError, ValueError):  # a plain body that cannot take them promises nothing
        return False
    return behind < INVISIBLE if language.gpu else behind == nowhere == 0


def _limits_itself(writer: Writer, value: Value) -> bool:
    """Whether the cosine is used but in what is limited to 0..1 anyway, and in the gate."""
    text = "\n".join([*writer.lines[1:], writer.term(value).text])
    limited = re.findall(re.escape(writer.language.saturated("\0")).replace("\0", r"[^()]*\bcosine\b[^()]*"), text)
    return len(limited) == len(re.findall(r"\bcosine\b", text))


def _body(
    spec: Approximation, form: str, setting: Setting, writer: Writer, *, gated: bool, unit: bool = False
) -> tuple[Writer, Value]:
    """The statements up to the value, and the value.

    unit  whether the cosine is limited to 0..1
    """
    coordinate = _coordinate(writer, form, setting, gated=gated, unit=unit)
    numbers = dict(spec.coefficients(setting))
    given = [name for name in spec.arguments if name not in spec.knowns]
    rest: list[Value] = [Term("TABLE", kind="table") if name == "table" else float(numbers[name]) for name in given]
    return writer, writer.call(spec.kernel, [coordinate, *rest], dict(known_values(spec, setting)))


def _coordinate(writer: Writer, form: str, setting: Setting, *, gated: bool, unit: bool) -> Value:
    """Statements that make the cosine, where it is needed, and what the kernel takes: the cosine, or lambda."""
    language, (a, b, _) = writer.language, DIRECTIONS[setting.space]
    writer.reserve("cosine", a, b)
    cosine = Term("cosine", low=0.0, high=1.0) if unit else Term("cosine")
    if gated or form in ("none", "dot", "tan2"):
        value = _by_components(writer, lambda_forms.dot, a, b) if language.components else Term(f"dot({a}, {b})")
        text = writer.term(writer.limit(value) if unit else value).text
        writer.lines.append(language.declared(language.float_type, "cosine", text))
    if form == "none":
        return cosine
    if form == "dot":
        return Affine(cosine, -1.0, 1.0)
    if language.components:
        value = _by_components(writer, lambda_forms.LAMBDA_FORMS[form], a, b)
        return replace(value, base=replace(value.base, low=0.0)) if isinstance(value, Affine) else value
    statements, scale = _FORMS[form]
    kinds = {"float": language.float_type, "direction": language.direction[0]}
    for kind, name, text in statements:
        writer.reserve(name)
        writer.lines.append(language.declared(kinds[kind], name, text.format(a=a, b=b)))
    return Affine(Term(statements[-1][1], low=0.0), scale)


def _by_components(writer: Writer, body: object, a: str, b: str) -> Value:
    axes = writer.language.components or ()
    return writer.call(body, [Term(name + axis) for name in (a, b) for axis in axes])  # type: ignore[arg-type]
