"""From scalar bodies to the statements of one function in another language.

`lower` has done the thinking: loops are unrolled, known arguments folded, constants named. Here coefficients get their
values and calls are written out, so that constants meet and what is left is what the language's compiler must do: see
`values`. Roundings differ from the kernels' in the last bits.
"""

import ast
import inspect
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import chain, count
from typing import Any

import numpy as np

from phongbench.compiler import elementary
from phongbench.compiler.lowering import FLOAT32, Body, lower, parsed
from phongbench.errors import KernelError
from phongbench.formulas.shader_code.body import BodyWriter
from phongbench.formulas.shader_code.language import BUILT_IN, HELD, Language
from phongbench.formulas.shader_code.spellings import INSTEAD, ON_GPU, PRIMITIVES
from phongbench.formulas.shader_code.values import (
    ATOM,
    CHOICE,
    PRODUCT,
    SIGN,
    SUM,
    Affine,
    Term,
    Value,
    high_of,
    low_of,
)

#: helpers, where subnormal numbers are slow on some processors: x above the least or 0, and the square of that
GUARDED, GUARDED_SQUARE = "guarded", "guarded_square"

_LARGEST = {name: float(np.finfo(held).max) for name, held in HELD.items()}


class Writer:
    """Writes statements of a function, and remembers what must stand in front of it.

    language  what it writes
    table     values of the only table that a formula may have, or None
    limited   whether values of unit vectors may be assumed to end at 1: over-long vectors then give no more
    lines     statements so far
    called    functions of the language that they call, in GLSL's words
    helpers   text of functions that the language lacks and that were called
    numbers_where_lit  names that are numbers wherever the gate lets light through: of the cosine and its multiples
    """

    def __init__(self, language: Language, table: Any = None, *, limited: bool = True) -> None:
        self.language, self.table, self.limited = language, table, limited and language.gpu
        self.lines: list[str] = []
        self.called: set[str] = set()
        self.helpers: dict[str, str] = {}
        self.numbers_where_lit: set[str] = set()
        self._names = {"highlight", "TABLE", *BUILT_IN}

    # bodies

    def call(self, body: Body, arguments: Sequence[Value], known: Mapping[str, int] | None = None) -> Value:
        """Write what a body does with these arguments, those that are known when compiling left out; its value.

        Raises KernelError for a body that cannot be lowered or calls a primitive without spelling.
        """
        if body is elementary.squared and (self.language.gpu or GUARDED_SQUARE in self.language.helpers):
            return self._squarings(arguments[0], (known or {})["n"])
        if body is elementary.above_underflow and GUARDED in self.language.helpers:
            return self._guarded(GUARDED, arguments[0], (known or {})["exponent"])
        spelling = (ON_GPU if self.language.gpu else {}).get(body, PRIMITIVES.get(body))
        if spelling is not None:
            names = [name for name in inspect.signature(body).parameters if name not in (known or {})]
            source, scope, callees = f"def spelled({', '.join(names)}):\n    return {spelling}", {}, {}
        elif hasattr(body, "__implementations__"):
            fix = "add it to PRIMITIVES in phongbench.formulas.shader_code.spellings"
            raise KernelError(f"{body.__name__} has no spelling outside Python", None, fix)
        else:
            lowered: Any = lower(INSTEAD.get(body, body), FLOAT32, **(known or {}))
            source, scope, callees = lowered.__lowered_source__, lowered.__globals__, lowered.__callees__
        definition = _parsed(source)
        return BodyWriter(self, scope, callees).run(definition, arguments)

    def _squarings(self, value: Value, n: int) -> Value:
        """max(0, x) ** (2 ** n); on GPUs without a guard against subnormal numbers."""
        if not self.language.gpu:
            x = self._guarded(GUARDED_SQUARE if n else GUARDED, value, 2**n)
            return self._squared(x, n - 1)
        # a limit costs nothing, a maximum an instruction; but of 1 less a square compilers know that it is at most 1
        known = isinstance(value, Affine) and value.base.high == math.inf and not self.language.saturated_sum
        free = self.limited if high_of(value) > 1.0 else not known
        return self._squared(self.limit(value) if free else self.largest(value, 0.0), n)

    def _squared(self, x: Value, n: int) -> Value:
        x = self.named("x", x) if n > 0 else x
        for _ in range(n):
            x = self.named("x", self.product(x, x))
        return x

    def _guarded(self, helper: str, value: Value, exponent: int) -> Value:
        """x, or its square, or 0 where x to the exponent is below 2^-120; see `elementary.above_underflow`."""
        return replace(self.function(helper, [value, 2.0 ** (-120.0 / exponent)]), low=0.0)

    def limit(self, value: Value) -> Value:
        """The value limited to 0..1."""
        if low_of(value) >= 0.0 and high_of(value) <= 1.0:
            return value
        if self.language.saturated_sum and (parts := _multiply_add(value)):
            return replace(self.function(self.language.saturated_sum, parts), low=0.0, high=1.0)
        return Term(self.language.saturated(self.term(value).text), low=0.0, high=1.0)

    def clamped(self, value: Value, low: Value, high: Value) -> Value:
        """The value limited to low..high, by the language's own word where it has one."""
        if isinstance(low, float) and isinstance(high, float):
            if low_of(value) >= low:
                return self.smallest(value, high)
            if (low, high) == (0.0, 1.0) and self.language.gpu:
                return self.limit(value)
        return self.function("clamp", [value, low, high])

    def largest(self, value: Value, least: float) -> Value:
        """max(value, least)."""
        return value if low_of(value) >= least else self.function("max", [value, least])

    def smallest(self, value: Value, most: float) -> Value:
        """min(value, most)."""
        if high_of(value) <= most:
            return value
        return self.function("min", [value, most]) if self.language.gpu else self.chosen_end(value, "<", most)

    def positive(self, value: Value) -> Value:
        """max(value, 0)."""
        if self.language.gpu or low_of(value) >= 0.0:
            return self.largest(value, 0.0)
        return self.chosen_end(value, ">", 0.0)

    def chosen_end(self, value: Value, order: str, end: float) -> Term:
        """A maximum or minimum by a choice, which compilers of processors know better than their libraries' calls.

        NaN gives the end: only such a choice is one instruction everywhere.
        """
        text, other = self.within(self.named("x", value), SUM), self.term(end).text
        low, high = low_of(value), high_of(value)
        low, high = (max(low, end), high) if order == ">" else (low, min(high, end))
        return Term(self.language.chosen(f"{text} {order} {other}", text, other), CHOICE, low=low, high=high)

    # names and text

    def reserve(self, *names: str) -> None:
        """Nothing else gets these names."""
        self._names |= set(names)

    def name(self, hint: str) -> str:
        """A name that nothing has yet, like this one."""
        word = self.language.word(hint)
        name = next(n for n in chain([word], (f"{word}_{k}" for k in count(2))) if n not in self._names)
        self._names.add(name)
        return name

    def named(self, hint: str, value: Value) -> Value:
        """The value under a name, by a statement, unless it is one already or a number."""
        if isinstance(value, int | float) or (isinstance(value, Term) and value.simple):
            return value
        if isinstance(value, Affine) and value.scale == 1 and value.offset == 0:
            return value.base
        term, name = self.term(value), self.name(hint)
        kind = {"float": self.language.float_type, "int": self.language.integer_type}.get(term.kind, "bool")
        self.lines.append(self.language.declared(kind, name, term.text))
        if isinstance(value, Affine) and value.base.text in self.numbers_where_lit:
            self.numbers_where_lit.add(name)
        return Term(name, ATOM, term.kind, term.low, term.high, whole=value.whole)

    def term(self, value: Value) -> Term:
        """The value as text."""
        if isinstance(value, Term):
            return value
        if isinstance(value, bool):
            return Term(self.language.logic["true" if value else "false"], ATOM, "bool")
        if isinstance(value, int):
            return Term(str(value), ATOM if value >= 0 else SIGN, "int")
        if isinstance(value, float):
            return self._number(value)
        return self._multiple(value)

    def within(self, value: Value, binding: int) -> str:
        """The value as text, in brackets if it binds less closely."""
        term = self.term(value)
        return term.text if term.binding >= binding else f"({term.text})"

    def _number(self, value: float) -> Term:
        if not _held(value, self.language.precision):
            held = HELD[self.language.precision].__name__
            fix = "shading languages have no other" if held == "float32" else "write it in float32, or lower alpha"
            raise KernelError(f"the constant {value:.8g} is not a finite {held}", None, fix)
        return Term(self.language.number(value), ATOM if value >= 0 else SIGN, low=value, high=value)

    def _multiple(self, value: Affine) -> Term:
        """scale * base + offset, its signs where people write them."""
        if value.offset == 0 and value.scale == 1:
            return value.base
        size = abs(value.scale)
        part = value.base.text if size == 1 else f"{self._number(size).text} * {value.base.text}"
        if value.offset == 0:
            return Term(part if value.scale > 0 else f"-{part}", PRODUCT, low=value.low, high=value.high)
        if self.language.fused and size != 1:
            called = self.function("multiply_add", [value.scale, value.base, value.offset])
            return replace(called, low=value.low, high=value.high)
        if value.scale < 0:
            text = f"{self._number(value.offset).text} - {part}"
        else:
            text = f"{part} {'+' if value.offset > 0 else '-'} {self._number(abs(value.offset)).text}"
        return Term(text, SUM, low=value.low, high=value.high)

    # arithmetic

    def affine(self, hint: str, value: Value) -> Affine | None:
        """The value as a multiple of a name; None for numbers and for what is no float."""
        if isinstance(value, Affine):
            return value
        if not isinstance(value, Term) or value.kind != "float":
            return None
        base = self.named(hint, value)
        assert isinstance(base, Term)
        return Affine(base, 1.0)

    def product(self, left: Value, right: Value) -> Value:
        """left * right of floats."""
        low = 0.0 if left == right or min(low_of(left), low_of(right)) >= 0 else -math.inf
        high = high_of(left) * high_of(right) if low == 0 and min(low_of(left), low_of(right)) >= 0 else math.inf
        text = f"{self.within(left, PRODUCT)} * {self.within(right, SIGN)}"
        return Term(text, PRODUCT, low=low, high=high, parts=(left, right))

    def function(self, name: str, arguments: Sequence[Value]) -> Term:
        """A call of a function of the language, or of a helper that is put in front."""
        if name in self.language.helpers:
            self.helpers[name] = self.language.helpers[name]
        self.called.add(name)
        passed = ", ".join(self.term(a).text for a in arguments)
        kind = "int" if name in ("int", "float_bits") else "float"
        low = {"max": max, "min": min}[name](map(low_of, arguments)) if name in ("max", "min") else -math.inf
        high = {"max": max, "min": min}[name](map(high_of, arguments)) if name in ("max", "min") else math.inf
        return Term(f"{self.language.function_name(name)}({passed})", ATOM, kind, low, high)


def _multiply_add(value: Value) -> tuple[Value, ...]:
    """The factors and the summand of what is one multiply-add; nothing of another value."""
    if isinstance(value, Affine) and value.offset and abs(value.scale) != 1:
        return value.scale, value.base, value.offset
    return value.parts if isinstance(value, Term) and value.binding == SUM else ()


@lru_cache(1024)
def _parsed(source: str) -> ast.FunctionDef:
    """The function that a lowered source defines; nobody changes it."""
    definition = parsed(source).body[0]
    assert isinstance(definition, ast.FunctionDef)
    return definition


def _held(value: float, precision: str) -> bool:
    """Whether a precision has a number for it; what is a little above its largest one is rounded to that."""
    if abs(value) <= _LARGEST[precision]:
        return True
    with np.errstate(over="ignore"):
        return bool(np.isfinite(HELD[precision](value)))
