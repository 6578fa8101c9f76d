"""The function `highlight` of a formula in a language: from directions to a coordinate, the kernel, and a gate.

The gate `cosine > 0` is written where light would leak past 90 degrees otherwise, and nowhere else.
"""

import math
import re
from collections.abc import Callable
from dataclasses import replace

from phongbench.formulas import lambda_forms
from phongbench.formulas.formula import Formula
from phongbench.formulas.kernel import known_values, needs_gate
from phongbench.formulas.normalising import NORMALISE
from phongbench.formulas.shader_code.language import Language
from phongbench.formulas.shader_code.raw_vectors import Pair, arguments, prepared
from phongbench.formulas.shader_code.values import Affine, Term, Value
from phongbench.formulas.shader_code.writer import Writer
from phongbench.formulas.spec import Approximation, Setting

#: lambda form -> (type, name, expression) of the variables that lead to a quantity, of which lambda is the half, from
#: directions {a} and {b}, by its {dot} and {cross}; as in lambda_forms.py
_FORMS: dict[str, tuple[tuple[str, str, str], ...]] = {
    "difference": (("direction", "d", "{a} - {b}"), ("float", "squared_distance", "{dot}(d, d)")),
    "cross": (("direction", "c", "{cross}({a}, {b})"), ("float", "squared_sine", "{dot}(c, c){squares}")),
    "tan2": (("direction", "c", "{cross}({a}, {b})"), ("float", "squared_tangent", "{dot}(c, c) / (cosine * cosine)")),
}
#: the product of both squared lengths, which a pair that is normalised as a whole is divided by
_SQUARES = "{dot}({a}, {a}) * {dot}({b}, {b})"
#: what limits a value, on which writer
Limit = Callable[[Writer, Value], Value]
#: in GLSL's words
ARC = "acos"
#: what nobody sees: half a step of float32 at 1, and half of the least subnormal float16
INVISIBLE = 2.0**-25


def written(
    spec: Approximation, formula: Formula, setting: Setting, language: Language, *, limited: bool = True
) -> str:
    """The function, and what the language needs in front of it.

    limited  whether over-long vectors give no more than 1, on GPUs; else as much as the formula says
    """
    table = None if spec.table is None else spec.table(setting)
    gated = not dark_behind(spec, formula, setting, language)
    writer, value = _best_body(spec, formula, setting, lambda: Writer(language, table, limited=limited), gated=gated)
    if gated:
        dark, value = writer.term(0.0).text, writer.named("value", value)
        value = Term(language.chosen(f"cosine > {dark}", writer.term(value).text, dark))
    lines = [*language.unpacked(list(arguments(formula))), *writer.lines, language.returned(writer.term(value).text)]
    kind, name = language.direction
    taken = [(kind, name.format(direction)) for direction in arguments(formula)]
    header = language.header(language.float_type, "highlight", taken)
    parts = [language.preamble] if language.preamble else []
    if table is not None:
        values = [language.number(float(entry)) for entry in (*table, table[-1])]  # see spellings.interpolated
        parts.append(language.listed(language.float_type, language.function_name("TABLE"), values))
    return "\n\n".join([*parts, *writer.helpers.values(), language.function(header, lines)])


def dark_behind(spec: Approximation, formula: Formula, setting: Setting, language: Language) -> bool:
    """Whether nobody sees what the code gives where a.b is not positive, without a gate.

    So it is where the kernel needs none, and where its value falls from the peak and has vanished at 90 degrees: on
    GPUs below INVISIBLE, elsewhere to 0, NaN included.
    """
    form = formula.lambda_form
    if form not in ("none", "dot") or formula.normalise == "squared":
        return False
    if not needs_gate(spec, form, setting):
        return True
    if not spec.falls:
        return False
    value = spec.bound(setting)
    try:
        behind, nowhere = abs(float(value(0.0 if form == "none" else 1.0))), float(value(math.nan))
    except (ArithmeticError, ValueError):  # a plain body that cannot take them promises nothing
        return False
    return behind < INVISIBLE if language.gpu else behind == nowhere == 0


def _best_body(
    spec: Approximation, formula: Formula, setting: Setting, new: Callable[[], Writer], *, gated: bool
) -> tuple[Writer, Value]:
    """The statements up to the value, and the value; the cosine is limited where that is needed or spares work."""
    writer, value = _body(spec, formula, setting, new(), gated=gated)
    language, of_cosine, limit = writer.language, formula.lambda_form in ("none", "dot"), None
    if writer.limited and of_cosine and not _limits_itself(writer, value):
        bounded = language.saturated_sum or writer.called & {"clamp", "max", "min"}
        if formula.normalise in ("each", "once") and not bounded:  # its cosine is above 1 by rounding alone
            return writer, writer.limit(value)
        limit = Writer.limit
    elif not (language.gpu or gated) and formula.lambda_form == "none" and ARC in writer.called:
        limit = Writer.positive  # arcs of positive cosines are half the work; the rest is dark
    return (writer, value) if limit is None else _body(spec, formula, setting, new(), gated=gated, limit=limit)


def _limits_itself(writer: Writer, value: Value) -> bool:
    """Whether the cosine is used in nothing but what is limited to 0..1 anyway."""
    text = "\n".join([*writer.lines, writer.term(value).text])
    uses = re.findall(r"\bcosine\b", text)
    language = writer.language
    words = [language.saturated("\0")]
    words += [f"{language.function_name(language.saturated_sum)}(\0)"] if language.saturated_sum else []
    limited = "|".join(re.escape(word).replace("\0", r"[^()]*\bcosine\b[^()]*") for word in words)
    return len(re.findall(limited, text)) == len(uses) - 1  # one is its own statement


def _body(
    spec: Approximation, formula: Formula, setting: Setting, writer: Writer, *, gated: bool, limit: Limit | None = None
) -> tuple[Writer, Value]:
    """The statements up to the value, and the value.

    limit  what the cosine is limited by, if at all
    """
    pair = prepared(writer, formula)
    find = _coordinate_in_components if writer.language.components else _coordinate
    coordinate = find(writer, formula, pair, gated=gated, limit=limit)
    numbers = dict(spec.coefficients(setting))
    given = [name for name in spec.arguments if name not in spec.knowns]
    rest: list[Value] = [Term("TABLE", kind="table") if name == "table" else float(numbers[name]) for name in given]
    return writer, writer.call(spec.kernel, [coordinate, *rest], dict(known_values(spec, setting)))


def _cosine(writer: Writer, value: Value, *, gated: bool, limit: Limit | None) -> Term:
    """The statement of the cosine, limited if it is to be, and what leaves the function early where it is dark."""
    writer.reserve("cosine")
    limited = writer.term(limit(writer, value) if limit else value)
    writer.lines.append(writer.language.declared(writer.language.float_type, "cosine", limited.text))
    if gated:
        writer.numbers_where_lit.add("cosine")
        writer.lines += writer.language.leaving("cosine", writer.term(0.0).text)
    return Term("cosine", low=limited.low, high=limited.high)


def _coordinate(writer: Writer, formula: Formula, pair: Pair, *, gated: bool, limit: Limit | None) -> Value:
    """Statements that make the cosine, where it is needed, and what the kernel takes: the cosine, or lambda."""
    language, form = writer.language, formula.lambda_form
    ab = {"a": pair.a, "b": pair.b, "dot": language.function_name("dot"), "cross": language.function_name("cross")}
    whole, squares = formula.normalise in ("once", "squared"), _SQUARES.format(**ab)
    if gated or form in ("none", "dot", "tan2"):
        root = language.function_name("inversesqrt")
        scale = f" * {root}({squares})" if formula.normalise == "once" and form in ("none", "dot") else ""
        cosine = _cosine(
            writer,
            Term("{dot}({a}, {b})".format(**ab) + scale),
            gated=gated,
            limit=None if formula.normalise == "squared" else limit,
        )
    if formula.normalise == "squared":
        return writer.named("ratio", Term(f"cosine * cosine / ({squares})", low=0.0, high=1.0))
    if form in ("none", "dot"):
        return cosine if form == "none" else Affine(cosine, -1.0, 1.0)
    kinds = {"float": language.float_type, "direction": language.direction[0]}
    for kind, name, text in _FORMS[form]:
        writer.reserve(name)
        expression = text.format(**ab, squares=f" / ({squares})" if whole else "")
        writer.lines.append(language.declared(kinds[kind], name, expression))
    return Affine(Term(_FORMS[form][-1][1], low=0.0), 0.5)


def _coordinate_in_components(
    writer: Writer, formula: Formula, pair: Pair, *, gated: bool, limit: Limit | None
) -> Value:
    """The same where a language has no vectors, by the bodies that the kernels call."""
    form, bodies = formula.lambda_form, dict(NORMALISE[formula.normalise].forms)
    once = limit is not None and formula.normalise == "once"
    if (gated and not once) or (form in ("none", "dot") and not bodies):
        cosine = _cosine(
            writer, writer.call(lambda_forms.dot, pair.parts), gated=gated, limit=None if bodies else limit
        )
    if form in ("none", "dot") and not bodies:
        return cosine if form == "none" else Affine(cosine, -1.0, 1.0)
    if form in ("none", "dot") and once:
        cosine = _cosine(writer, writer.call(bodies["none"], pair.parts), gated=gated, limit=limit)
        return cosine if form == "none" else Affine(cosine, -1.0, 1.0)
    value = writer.call(bodies.get(form) or lambda_forms.LAMBDA_FORMS[form], pair.parts)
    if form in ("none", "dot") or not isinstance(value, Affine):
        return value
    return replace(value, base=replace(value.base, low=0.0))
