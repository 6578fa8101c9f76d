"""What of a formula's code decides its cost: everything but its numbers.

Formulas whose code differs in constants only, as other exponents and slopes make it, cost the same. So costs are kept
by the shape of the code, and a formula's cost is found by writing its code and looking up the shape. A few numbers cost
less than others on AMD's GPUs, whose instructions hold them: code with such numbers has an exact shape besides.
"""

import hashlib
import re
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import product

from phongbench.errors import InputError
from phongbench.formulas.formula import Formula, Registry
from phongbench.formulas.normalising import NORMALISE
from phongbench.formulas.recipes import PAIR, RECIPES
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.shader_code.export import source
from phongbench.formulas.shader_code.language import FLOAT32
from phongbench.formulas.shader_code.languages import language_named
from phongbench.formulas.shader_code.raw_vectors import arguments
from phongbench.formulas.spec import Approximation
from phongbench.inputs.plan import PRESETS, QUICK_ALPHAS, STANDARD_ALPHAS

#: Exponents that between them bring out every shape: the usual one first, then some that make slopes of powers of two,
#: and some that make others, for supports that end before 90 degrees and behind.
ALPHAS = (50.0, 1000.0, *(2.0**k for k in range(-2, 9)), *(1.4 * 2.0**k for k in range(-4, 8)))
#: whole powers, whose code is another for every exponent
WHOLE_ALPHAS = (*map(float, range(1, 33)), *(a for a in (*QUICK_ALPHAS, *STANDARD_ALPHAS) if a > 32 and a == int(a)))
#: powers of chains on vectors that are made from others, or made unit, first
RAW_GAMMAS = (8, 16, 32)
#: hexadecimal digits of a shape
DIGITS = 16
#: numbers that compilers treat as no other: what they multiply, or are the exponent of, is not computed
_SPECIAL = {0.0, 1.0}
#: numbers that AMD's instructions hold: of two others that an instruction needs, one takes a register and a move
_INLINE = {0.5, 2.0, 4.0}
#: the language of AMD's GPUs, the only one of which exact shapes are kept
_EXACT = "glsl"
#: what ends a statement, and what in a statement makes a number that is held save a move, or more, though it is alone
_ENDS, _SAVING = re.compile(r"[;{}]"), re.compile(r"\bpow\(|/")
_COMMENT = re.compile(r"//[^\n]*")
_TABLE = re.compile(r"^(?:const|static|var).* TABLE\b.*$", re.MULTILINE)
_NUMBER = re.compile(r"\b\d+(?:\.\d*(?:e[-+]?\d+)?|e[-+]?\d+)f?")


@dataclass(frozen=True, slots=True)
class Code:
    """A formula written for a compiler.

    name     of the formula, as it is spelled, and the exponent it is written for: "lyon:dot:8 50"
    text     its source, see `shader_code.export.source`
    vectors  how many directions `highlight` takes
    precision  of its numbers
    """

    name: str
    text: str
    vectors: int = 2
    precision: str = FLOAT32

    @property
    def has_table(self) -> bool:
        """Whether it reads a table."""
        return "TABLE" in self.text

    @property
    def shape(self) -> str:
        """Digest of the code without comments and numbers, but for those that compilers treat as no other.

        Names of directions do not count either.
        """
        return _shape(self.text, frozenset(_SPECIAL))

    @property
    def exact_shape(self) -> str:
        """Likewise, but for those also that AMD's instructions hold."""
        return _shape(self.text, frozenset(_SPECIAL | _INLINE))

    @property
    def held_numbers_matter(self) -> bool:
        """Whether numbers that instructions hold may make it cheaper.

        They do beside another number in the same statement, in a power and in code with a quotient: one instruction
        takes one number that it does not hold, and zero and one are always held.
        """
        text = _COMMENT.sub("", self.text)
        numbers = [[float(n[0].rstrip("f")) for n in _NUMBER.finditer(part)] for part in _ENDS.split(text)]
        return bool(_SAVING.search(text)) or any(len([n for n in part if n not in _SPECIAL]) > 1 for part in numbers)


@lru_cache(maxsize=1 << 14)
def _shape(text: str, kept: frozenset[float]) -> str:
    """See `Code.shape`; every target that shares the language asks for it."""

    def without_value(number: re.Match[str]) -> str:
        value = float(number[0].rstrip("f"))
        return str(value) if value in kept else "#"

    bare = _NUMBER.sub(without_value, _TABLE.sub("TABLE", _COMMENT.sub("", text)))
    bare = re.sub(r"\bn\b", "r", re.sub(r"\bh\b", "v", bare))
    return hashlib.sha256(" ".join(bare.split()).encode()).hexdigest()[:DIGITS]


def code(
    formula: Formula,
    alpha: float,
    language: str,
    registry: Registry = REGISTRY,
    *,
    limited: bool = True,
    precision: str = FLOAT32,
) -> Code:
    """The code of a formula at an exponent; InputError for an exponent that it does not take.

    limited    whether over-long vectors give no more than 1, see `shader_code.export.source`
    precision  that it is written in; InputError for one that the language lacks, or that cannot hold a constant
    """
    text = source(formula, alpha, language_named(language).in_precision(precision), registry, limited=limited)
    return Code(f"{formula.spelled(registry)} {alpha:g}", text, len(arguments(formula)), precision)


@lru_cache(maxsize=1 << 14)
def shipped_code(formula: Formula, alpha: float, language: str, precision: str = FLOAT32) -> Code | None:
    """The code of a formula that ships, written once; None for an exponent, or a way with lengths, that has none."""
    with suppress(InputError):
        return code(formula, alpha, language, precision=precision)
    return None


def catalogue(language: str, registry: Registry = REGISTRY, precision: str = FLOAT32) -> tuple[Code, ...]:
    """The code of every formula of the full study, one for each shape, in the study's order; see `by_shape`.

    What a precision shorter than float32 cannot be written in, such as tricks with bits, is left out.
    """
    codes: dict[str, Code] = {}
    lacking = () if precision == FLOAT32 else (InputError,)
    for spec in registry.values():
        for formula, alpha in _formulas(spec):
            with suppress(*lacking):
                one = code(formula, alpha, language, registry, precision=precision)
                first = codes.setdefault(one.shape, one)
                if language == _EXACT and one.held_numbers_matter and one.exact_shape != first.exact_shape:
                    codes.setdefault(one.exact_shape, one)
    return tuple(codes.values())


def by_shape(codes: Sequence[Code]) -> dict[str, Code]:
    """Codes by what they are found by: the first of a shape by that, others of the same by their exact shapes."""
    found: dict[str, Code] = {}
    for one in codes:
        found[one.exact_shape if one.shape in found else one.shape] = one
    return found


def _formulas(spec: Approximation) -> Iterator[tuple[Formula, float]]:
    """The formulas of the full study at every exponent here that they take; of raw vectors, at the first one."""
    whole = "exponent" in spec.knowns
    registry = {spec.name: spec}
    for formula, alpha in replace(PRESETS["full"], alphas=WHOLE_ALPHAS if whole else ALPHAS).formulas(spec):
        with suppress(InputError):
            formula.check(alpha, registry)
            yield formula, alpha
    forms = [form for form in spec.lambda_forms if form != "tan2"]  # free of lengths by itself
    for gamma, form in product(RAW_GAMMAS if spec.uses_gamma else (None,), forms):
        for recipe, normalise in product((PAIR, *RECIPES), NORMALISE):
            with suppress(InputError):
                formula = Formula.of(spec.name, form, gamma, recipe=recipe, normalise=normalise, registry=registry)
                source(formula, ALPHAS[0], language_named("glsl"), registry)
                yield formula, ALPHAS[0]
