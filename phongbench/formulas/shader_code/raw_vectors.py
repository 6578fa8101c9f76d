"""Statements of a shader that make the pair from N, L and V, and that remove lengths: what stands before a formula."""

from dataclasses import dataclass, field

from phongbench.compiler.lowering import Body
from phongbench.errors import InputError
from phongbench.formulas import normalising, recipes
from phongbench.formulas.formula import Formula
from phongbench.formulas.lambda_forms import dot
from phongbench.formulas.normalising import NORMALISE
from phongbench.formulas.recipes import PAIR
from phongbench.formulas.shader_code.printer import Speller

#: a recipe's statements in a language with vectors: (name, text)
_MADE = {
    "reflect": (("m", "n * (1.0 / sqrt(dot(n, n)))"), ("r", "2.0 * dot(m, l) * m - l")),
    "lengthwise": (("r", "2.0 * dot(n, l) * n - dot(n, n) * l"),),
    "halfway": (("h", "l * (1.0 / sqrt(dot(l, l))) + v * (1.0 / sqrt(dot(v, v)))"),),
}
_PAIR_OF = {"reflect": ("r", "v"), "lengthwise": ("r", "v"), "halfway": ("n", "h")}
#: what a formula takes in place of the cosine or the lambda form, of a pair treated as a whole
_TOGETHER = {
    ("once", "none"): "dot({a}, {b}) / sqrt(dot({a}, {a}) * dot({b}, {b}))",
    ("once", "dot"): "1.0 - dot({a}, {b}) / sqrt(dot({a}, {a}) * dot({b}, {b}))",
    ("once", "cross"): "0.5 * dot(c, c) / (dot({a}, {a}) * dot({b}, {b}))",
    ("squared", "none"): "dot({a}, {b}) * dot({a}, {b}) / (dot({a}, {a}) * dot({b}, {b}))",
}


@dataclass
class Prepared:
    """What stands before the formula's own statements.

    lines       statements
    a, b        the names of the pair from there on; with components, component by component
    coordinate  the expression that replaces the lambda form's, where the pair is treated as a whole; else ""
    """

    a: str
    b: str
    lines: list[str] = field(default_factory=list)
    coordinate: str = ""


def arguments(formula: Formula, pair: tuple[str, str]) -> tuple[str, ...]:
    """Names of the directions that `highlight` takes: of the pair, or n, l and v of a recipe."""
    return pair if formula.recipe == PAIR else ("n", "l", "v")


def prepared(speller: Speller, formula: Formula, pair: tuple[str, str]) -> Prepared:
    """The statements of a formula's recipe and of its way to normalise. InputError for tricks of processors."""
    if NORMALISE[formula.normalise].precisions:
        fix = f"write {formula.approximation}/each: the language's own root is what a GPU has"
        raise InputError(f"{formula.normalise} is a trick of processors", str(formula), fix)
    made = Prepared(*(pair if formula.recipe == PAIR else _PAIR_OF[formula.recipe]))
    (_in_components if speller.language.components else _in_vectors)(speller, formula, made)
    return made


def _in_vectors(speller: Speller, formula: Formula, made: Prepared) -> None:
    language, form = speller.language, formula.lambda_form
    kind = language.direction[0]

    def declare(name: str, text: str) -> None:
        made.lines.append(language.declared(kind, name, text))

    for name, text in _MADE.get(formula.recipe, ()):
        declare(name, text)
    if formula.normalise == "each":
        for name, of in (("a", made.a), ("b", made.b)):
            declare(name, f"{of} * (1.0 / sqrt(dot({of}, {of})))")
        made.a, made.b = "a", "b"
    elif (text := _TOGETHER.get((formula.normalise, form), "")) and form == "cross":
        declare("c", f"cross({made.a}, {made.b})")
    made.coordinate = _TOGETHER.get((formula.normalise, form), "").format(a=made.a, b=made.b)


def _in_components(speller: Speller, formula: Formula, made: Prepared) -> None:
    language = speller.language

    def parts(name: str) -> list[str]:
        return [name + component for component in language.components or ()]

    def number(name: str, text: str) -> str:
        made.lines.append(language.declared(language.float_type, name, text))
        return name

    def vector(name: str, components: list[str]) -> None:
        number(f"{name}[3]", f"{{{', '.join(components)}}}")

    def call(body: Body, *given: str) -> str:
        return f"{speller.function(body)}({', '.join(given)})"

    def unit(name: str, of: str) -> None:
        p = number(f"{name}_scale", call(normalising.reciprocal_length, *parts(of)))
        vector(name, [f"{part} * {p}" for part in parts(of)])

    if formula.recipe == "halfway":
        p, q = (number(f"{v}_scale", call(normalising.reciprocal_length, *parts(v))) for v in ("l", "v"))
        vector("h", [call(recipes.halfway, x, p, y, q) for x, y in zip(parts("l"), parts("v"), strict=True)])
    elif formula.recipe != PAIR:
        normal, mirror = ("m", recipes.mirrored) if formula.recipe == "reflect" else ("n", recipes.mirrored_lengthwise)
        if formula.recipe == "reflect":
            unit("m", "n")
        more = [number("twice", call(recipes.doubled_cosine, *parts(normal), *parts("l")))]
        if formula.recipe == "lengthwise":
            more.append(number("square", call(dot, *parts("n"), *parts("n"))))
        vector("r", [call(mirror, x, y, *more) for x, y in zip(parts(normal), parts("l"), strict=True)])
    if formula.normalise == "each":
        unit("a", made.a)
        unit("b", made.b)
        made.a, made.b = "a", "b"
    if bodies := dict(NORMALISE[formula.normalise].forms):
        made.coordinate = call(bodies[formula.lambda_form], *parts(made.a), *parts(made.b))
