"""What an expression is while code is written: a number, text of the language, or a multiple of a name plus a number.

Multiples are kept apart until they are needed, so that constants meet: 1 - beta (1 - x) becomes one multiply-add of x.
"""

import math
from dataclasses import dataclass

#: how closely an expression binds, the loosest first
CHOICE, OR, AND, ORDER, SUM, PRODUCT, SIGN, ATOM = range(8)


@dataclass(frozen=True, slots=True)
class Term:
    """An expression as text.

    binding    how closely its outermost operator binds
    kind       float, int or bool
    low, high  what a float cannot be below or above, whatever the input; NaN aside
    parts      the factors of a product; of a sum that ends in a product, its factors and the summand
    whole      (the name of a whole number, what is added to it), of a float that is their sum
    """

    text: str
    binding: int = ATOM
    kind: str = "float"
    low: float = -math.inf
    high: float = math.inf
    parts: "tuple[Value, ...]" = ()
    whole: "tuple[Term, int] | None" = None

    @property
    def simple(self) -> bool:
        """True for a name or a literal: it may be repeated."""
        return self.binding == ATOM and "(" not in self.text and "[" not in self.text


@dataclass(frozen=True, slots=True)
class Affine:
    """scale * base + offset, of a base that is a name."""

    base: Term
    scale: float
    offset: float = 0.0

    @property
    def low(self) -> float:
        """The least it can be."""
        return self.scale * (self.base.low if self.scale > 0 else self.base.high) + self.offset

    @property
    def high(self) -> float:
        """The most it can be."""
        return self.scale * (self.base.high if self.scale > 0 else self.base.low) + self.offset

    @property
    def whole(self) -> tuple[Term, int] | None:
        """See `Term.whole`."""
        if self.base.whole is None or self.scale != 1 or self.offset != int(self.offset):
            return None
        return self.base.whole[0], self.base.whole[1] + int(self.offset)

    def times(self, factor: float) -> "Affine":
        """The multiple."""
        return Affine(self.base, self.scale * factor, self.offset * factor)

    def plus(self, number: float) -> "Affine":
        """The sum."""
        return Affine(self.base, self.scale, self.offset + number)

    def joined(self, other: "Affine") -> "Affine | None":
        """The sum with a multiple of the same base; None for one of another."""
        if other.base != self.base:
            return None
        return Affine(self.base, self.scale + other.scale, self.offset + other.offset)


Value = Term | Affine | float | int


def is_number(value: Value) -> bool:
    """True for a float that is known."""
    return isinstance(value, float)


def low_of(value: Value) -> float:
    """What a value cannot be below."""
    return float(value) if isinstance(value, int | float) else value.low


def high_of(value: Value) -> float:
    """What a value cannot be above."""
    return float(value) if isinstance(value, int | float) else value.high
