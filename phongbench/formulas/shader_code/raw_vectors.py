"""Statements that make the pair from N, L and V, and that remove lengths: what stands before a formula."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from phongbench.compiler.lowering import Body
from phongbench.errors import InputError
from phongbench.formulas import normalising, recipes
from phongbench.formulas.formula import Formula
from phongbench.formulas.lambda_forms import dot
from phongbench.formulas.normalising import NORMALISE
from phongbench.formulas.recipes import PAIR
from phongbench.formulas.shader_code.values import Term, Value
from phongbench.formulas.shader_code.writer import Writer

#: space -> the names of both directions, and what they are
DIRECTIONS = {
    "reflect": ("r", "v", "r is the light's direction mirrored at the normal, v points to the viewer"),
    "half": ("n", "h", "n is the normal, h the direction half way between light and viewer"),
}
#: what is said of the directions of a recipe
FROM_N_L_V = "n is the normal, l points to the light, v to the viewer; of any length where the formula removes lengths"
#: a recipe's statements in a language with vectors: (name, text), by its own words for dot and the like
_MADE = {
    "reflect": (("m", "n * {rsqrt}({dot}(n, n))"), ("r", "{two} * {dot}(m, l) * m - l")),
    "lengthwise": (("r", "{two} * {dot}(n, l) * n - {dot}(n, n) * l"),),
    "halfway": (("h", "l * {rsqrt}({dot}(l, l)) + v * {rsqrt}({dot}(v, v))"),),
}
_PAIR_OF = {"reflect": ("r", "v"), "lengthwise": ("r", "v"), "halfway": ("n", "h")}


@dataclass
class Pair:
    """The pair that a formula works on.

    a, b    their names, in a language with vectors
    parts   components of a, then of b, in one without
    """

    a: str
    b: str
    parts: list[Value] = field(default_factory=list)


def arguments(formula: Formula) -> tuple[str, ...]:
    """Names of the directions that `highlight` takes: of the pair, or n, l and v of a recipe."""
    return DIRECTIONS[formula.space][:2] if formula.recipe == PAIR else ("n", "l", "v")


def prepared(writer: Writer, formula: Formula) -> Pair:
    """Write what makes the pair and, where each vector is made unit, that. InputError for tricks of processors."""
    if NORMALISE[formula.normalise].precisions:
        fix = f"write {formula.approximation}/each: the language's own root is what a GPU has"
        raise InputError(f"{formula.normalise} is a trick of processors", str(formula), fix)
    writer.reserve(*arguments(formula), "m", "r", "h", "a", "b", "c", "d")
    writer.reserve(*(name + axis for name in arguments(formula) for axis in writer.language.components or ()))
    return (_in_components if writer.language.components else _in_vectors)(writer, formula)


def _given(writer: Writer, name: str) -> list[Value]:
    """Components of an argument, in a language without vectors."""
    return [Term(name + axis) for axis in writer.language.components or ()]


def _in_vectors(writer: Writer, formula: Formula) -> Pair:
    language = writer.language
    words = {"rsqrt": language.function_name("inversesqrt"), "dot": language.function_name("dot")}
    words["two"] = language.number(2.0)

    def declare(name: str, text: str) -> str:
        writer.lines.append(language.declared(language.direction[0], name, text))
        return name

    for name, text in _MADE.get(formula.recipe, ()):
        declare(name, text.format(**words))
    a, b = DIRECTIONS[formula.space][:2] if formula.recipe == PAIR else _PAIR_OF[formula.recipe]
    if formula.normalise == "each":
        unit = "{of} * {rsqrt}({dot}({of}, {of}))"
        a, b = declare("a", unit.format(of=a, **words)), declare("b", unit.format(of=b, **words))
    return Pair(a, b)


def _in_components(writer: Writer, formula: Formula) -> Pair:
    def named(name: str, values: Sequence[Value]) -> list[Value]:
        return [writer.named(f"{name}{axis}", value) for axis, value in zip("xyz", values, strict=True)]

    def unit(name: str, of: Sequence[Value]) -> list[Value]:
        scale = writer.named(f"{name}_scale", writer.call(normalising.reciprocal_length, of))
        return named(name, [writer.product(part, scale) for part in of])

    first, second = (_given(writer, name) for name in DIRECTIONS[formula.space][:2])
    if formula.recipe == "halfway":
        light, view = _given(writer, "l"), _given(writer, "v")
        p, q = (writer.named("scale", writer.call(normalising.reciprocal_length, v)) for v in (light, view))
        made = [writer.call(recipes.halfway, [x, p, y, q]) for x, y in zip(light, view, strict=True)]
        first, second = _given(writer, "n"), named("h", made)
    elif formula.recipe != PAIR:
        normal, light, more = _given(writer, "n"), _given(writer, "l"), list[Value]()
        body: Body = recipes.mirrored
        if formula.recipe == "reflect":
            normal = unit("m", normal)
        else:
            body, more = recipes.mirrored_lengthwise, [writer.named("square", writer.call(dot, normal + normal))]
        twice = writer.named("twice", writer.call(recipes.doubled_cosine, normal + light))
        made = [writer.call(body, [x, y, twice, *more]) for x, y in zip(normal, light, strict=True)]
        first, second = named("r", made), _given(writer, "v")
    if formula.normalise == "each":
        first, second = unit("a", first), unit("b", second)
    return Pair("", "", [*first, *second])
