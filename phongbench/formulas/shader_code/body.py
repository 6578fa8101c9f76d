"""One body, statement by statement: what its names stand for, and what each expression becomes."""

import ast
import math
import operator
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any, TypeGuard

from phongbench.compiler import elementary
from phongbench.compiler.lowering import Body
from phongbench.errors import KernelError
from phongbench.formulas.shader_code.values import (
    AND,
    ATOM,
    CHOICE,
    OR,
    ORDER,
    PRODUCT,
    SIGN,
    SUM,
    Affine,
    Term,
    Value,
    high_of,
    low_of,
)

if TYPE_CHECKING:
    from phongbench.formulas.shader_code.writer import Writer

_COMPARISONS: Mapping[type[ast.AST], str] = {
    ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!=",
}  # fmt: skip
_ARITHMETIC: Mapping[type[ast.AST], tuple[str, int, Callable[[Any, Any], Any]]] = {
    ast.Add: ("+", SUM, operator.add),
    ast.Sub: ("-", SUM, operator.sub),
    ast.Mult: ("*", PRODUCT, operator.mul),
    ast.Div: ("/", PRODUCT, operator.truediv),
}


class BodyWriter:
    """Runs a lowered body with values for its arguments, while the writer collects statements.

    scope    constants of the lowered source by name
    callees  name in the lowered source -> the body that it calls
    """

    def __init__(self, writer: "Writer", scope: Mapping[str, Any], callees: Mapping[str, Body]) -> None:
        self.writer, self.scope, self.callees = writer, scope, callees
        self.values: dict[str, Value] = {}
        self.uses: Counter[str] = Counter()

    def run(self, definition: ast.FunctionDef, arguments: Sequence[Value]) -> Value:
        """The value of a call."""
        self.uses = _uses(definition)
        for argument, value in zip((a.arg for a in definition.args.args), arguments, strict=True):
            self._assign(argument, value)
        for statement in definition.body:
            match statement:
                case ast.Return(value=ast.expr() as result):
                    return self.value(result)
                case ast.Assign(targets=[ast.Name(id=name)], value=given):
                    self._assign(name, self.value(given))
                case _:
                    raise self._refusal(statement)
        raise KernelError(f"{definition.name} returns nothing", None, "end it by a return")

    def _assign(self, name: str, value: Value) -> None:
        """Give the name this value; what is used more than once gets a variable, but for 1 - x and the like on GPUs.

        Their compilers find the same again, and what is done with 1 - x is often one step of x.
        """
        inline = self.writer.language.gpu and isinstance(value, Affine) and abs(value.scale) == 1
        self.values[name] = self.writer.named(name, value) if self.uses[name] > 1 and not inline else value

    def _refusal(self, node: ast.AST) -> KernelError:
        return KernelError(f"`{ast.unparse(node)}` has no spelling in {self.writer.language.name}")

    def value(self, node: ast.expr) -> Value:
        """What an expression amounts to."""
        match node:
            case ast.Constant(value=bool() | int() | float() as value):
                return value
            case ast.Name(id=name) if name in self.values:
                return self.values[name]
            case ast.Name(id=name) if name in self.scope:
                return float(self.scope[name])
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                return self._negative(self.value(operand))
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                word = self.writer.language.logic["not"]
                return Term(f"{word}{self.writer.within(self.value(operand), ATOM)}", SIGN, "bool")
            case ast.BinOp(left=left, op=ast.Div(), right=ast.Call(func=ast.Name(id=name), args=[square])) if (
                self.writer.language.gpu and self.callees.get(name) is elementary.square_root
            ):  # GPUs have the reciprocal of a root as one instruction
                root = self.writer.function("inversesqrt", [self.value(square)])
                dividend = self.value(left)
                return root if dividend == 1.0 else self.writer.product(dividend, root)
            case ast.BinOp(left=left, op=op, right=right):
                return self._arithmetic(op, self.value(left), self.value(right))
            case ast.Compare(left=left, ops=ops, comparators=rest):
                return self._comparison([self.value(part) for part in (left, *rest)], ops)
            case ast.BoolOp(op=op, values=values):
                return self._joined("or" if isinstance(op, ast.Or) else "and", [self.value(v) for v in values])
            case ast.Call(func=ast.Name(id=name), args=arguments):
                return self._call(name, arguments)
        raise self._refusal(node)

    # arithmetic

    def _negative(self, value: Value) -> Value:
        if isinstance(value, int | float):
            return -value
        if isinstance(value, Term) and value.kind == "int":
            return Term(f"-{self.writer.within(value, ATOM)}", SIGN, "int")
        multiple = self.writer.affine("x", value)
        assert multiple is not None
        return multiple.times(-1.0)

    def _arithmetic(self, op: ast.operator, left: Value, right: Value) -> Value:
        sign, binding, operation = _ARITHMETIC[type(op)]
        if isinstance(left, int | float) and isinstance(right, int | float):
            return operation(left, right) if not isinstance(op, ast.Div) or right else math.inf
        folded = self._folded(op, left, right)
        if folded is None and isinstance(op, ast.Add | ast.Sub):
            folded = self._joined_multiples(op, left, right)
        if folded is not None:
            return folded
        if isinstance(op, ast.Mult):
            return self.writer.product(left, right)
        kind = "int" if _kind(left) == _kind(right) == "int" else "float"
        # a right operand that binds no closer keeps its brackets
        text = f"{self.writer.within(left, binding)} {sign} {self.writer.within(right, binding + 1)}"
        if not isinstance(op, ast.Add):
            return Term(text, binding, kind)
        parts = (*right.parts, left) if _is_product(right) else ()
        return Term(text, binding, kind, low_of(left) + low_of(right), parts=parts)

    def _joined_multiples(self, op: ast.operator, left: Value, right: Value) -> Value | None:
        """The sum or difference of multiples of one name, so that a - a x + x is one multiply-add; None for others."""
        if isinstance(left, Term) and isinstance(right, Affine):
            left = Affine(left, 1.0)
        if not isinstance(left, Affine):
            return None
        added = Affine(right, 1.0) if isinstance(right, Term) else right
        if not isinstance(added, Affine):
            return None
        found = left.joined(added.times(-1.0) if isinstance(op, ast.Sub) else added)
        return found.offset if found is not None and found.scale == 0 else found

    def _folded(self, op: ast.operator, left: Value, right: Value) -> Value | None:
        """The result as a multiple of a name, where a number meets something that is none."""
        number, other = (left, right) if isinstance(left, float) else (right, left)
        if isinstance(op, ast.Div) and isinstance(left, Affine) and left.offset == 0 and not isinstance(right, float):
            quotient = f"{left.base.text} / {self.writer.within(right, SIGN)}"
            base = self.writer.named("quotient", Term(quotient, PRODUCT))
            assert isinstance(base, Term)
            return Affine(base, left.scale)
        if not isinstance(number, float) or (isinstance(op, ast.Div) and (number is left or not number)):
            return None
        if self.writer.language.saturated_sum and number is left and isinstance(op, ast.Sub) and _is_product(other):
            factors = self._negative(other.parts[0]), other.parts[1]
            text = f"{self.writer.within(number, SUM)} - {other.text}"
            return Term(text, SUM, parts=(*factors, number))
        multiple = self.writer.affine("x", other)
        if multiple is None:
            return None
        if isinstance(op, ast.Mult | ast.Div):
            factor = number if isinstance(op, ast.Mult) else 1 / number
            return multiple.times(factor) if factor else 0.0
        if isinstance(op, ast.Add):
            return multiple.plus(number)
        return multiple.times(-1.0).plus(number) if number is left else multiple.plus(-number)

    # choices and calls

    def _comparison(self, parts: Sequence[Value], ops: Sequence[ast.cmpop]) -> Term:
        texts = [
            f"{self.writer.within(left, SUM)} {_COMPARISONS[type(op)]} {self.writer.within(right, SUM)}"
            for left, op, right in zip(parts, ops, parts[1:], strict=False)
        ]
        pairs = [Term(text, ORDER, "bool") for text in texts]
        return pairs[0] if len(pairs) == 1 else self._joined("and", pairs)

    def _joined(self, word: str, parts: Sequence[Value]) -> Term:
        """All of them, or any, by the language's word."""
        binding, language = AND if word == "and" else OR, self.writer.language
        least = ATOM if language.tight else binding + 1
        return Term(f" {language.logic[word]} ".join(self.writer.within(p, least) for p in parts), binding, "bool")

    def _choice(self, test: ast.expr, yes: Value, no: Value) -> Value:
        """yes if the test holds, else no; a minimum or maximum on GPUs, whose own ones are single instructions."""
        writer = self.writer
        match test:
            case ast.Compare(left=left, ops=[ast.Lt() | ast.LtE() | ast.Gt() | ast.GtE() as op], comparators=[right]):
                pair = self.value(left), self.value(right)
                if writer.language.gpu and pair in ((yes, no), (no, yes)):
                    smaller = isinstance(op, ast.Lt | ast.LtE) == (pair == (yes, no))
                    if not smaller and isinstance(yes, float):
                        return writer.largest(no, yes)
                    return writer.function("min" if smaller else "max", [yes, no])
                if pair == (no, yes) and isinstance(yes, float) and writer.term(no).text in writer.numbers_where_lit:
                    # what keeps NaN, which the gate makes dark anyway, costs more than a maximum
                    return writer.chosen_end(no, "<" if isinstance(op, ast.Gt | ast.GtE) else ">", yes)
        condition = writer.within(self.value(test), OR)
        text = writer.language.chosen(condition, writer.within(yes, OR), writer.within(no, OR))
        low, high = min(low_of(yes), low_of(no)), max(high_of(yes), high_of(no))
        return Term(text, CHOICE if "?" in text else ATOM, _kind(yes), low, high)

    def _call(self, name: str, arguments: list[ast.expr]) -> Value:
        if name == "_select":
            return self._choice(arguments[0], self.value(arguments[1]), self.value(arguments[2]))
        values = [self.value(a) for a in arguments]
        writer = self.writer
        if name in self.callees:
            return writer.call(self.callees[name], values, getattr(self.scope[name], "__known__", {}))
        match name, values:
            case (("_int_sum" | "_int_difference"), [left, right]):
                return self._arithmetic(ast.Add() if name == "_int_sum" else ast.Sub(), left, right)
            case "_entry", [_, index]:
                return Term(f"TABLE[{writer.term(index).text}]")
            case "len", _:
                return len(writer.table)
            case "_index", [value]:
                return value if _kind(value) == "int" else writer.function("int", [value])
            case "_cast", [Term(kind="int") as whole]:
                named = writer.term(writer.named("i", whole))
                return replace(writer.function("float", [named]), whole=(named, 0))
            case "_cast", [value]:
                return float(value) if isinstance(value, int) else writer.function("float", [value])
            case "_from_linear", [t]:
                return self._from_linear(t)
            case "_power", [x, y]:
                return self._power(x, y)
            case "clamp", [x, low, high]:
                return writer.clamped(x, low, high)
            case "max", [x, float() as least]:
                return writer.largest(x, least)
        return writer.function(name, values)

    def _power(self, x: Value, y: Value) -> Value:
        """x^y: pow(0, y) is 0 for a positive y, and pow of less is nothing on GPUs."""
        writer = self.writer
        if isinstance(y, float) and y > 0:
            base = writer.positive(x)
            return base if y == 1 else writer.function("pow", [base, y])
        x = writer.named("x", x)
        return Term(
            writer.language.chosen(
                f"{writer.within(x, SUM)} > {writer.term(0.0).text}",
                writer.function("pow", [x, y]).text,
                writer.term(0.0).text,
            ),
            CHOICE,
        )

    def _from_linear(self, t: Value) -> Value:
        """2^t by the bits of a float, see `float_bits.from_linear`; of a whole t by whole numbers alone."""
        if isinstance(t, Term | Affine) and t.whole is not None:
            i, more = t.whole
            exponent = self._arithmetic(ast.Add(), i, more + 127)
            bits = Term(f"{self.writer.within(exponent, PRODUCT)} * {1 << 23}", PRODUCT, "int")
        else:
            scaled = self.writer.function("int", [self._arithmetic(ast.Mult(), t, 2.0**23)])
            bits = self.writer.term(self._arithmetic(ast.Add(), scaled, 127 << 23))
        return self.writer.function("bits_float", [bits])


def _is_product(value: Value) -> TypeGuard[Term]:
    """Whether it is a product that has no name yet."""
    return isinstance(value, Term) and value.binding == PRODUCT and bool(value.parts)


def _kind(value: Value) -> str:
    if isinstance(value, Term):
        return value.kind
    return "int" if isinstance(value, int) and not isinstance(value, bool) else "float"


@lru_cache(1024)
def _uses(definition: ast.FunctionDef) -> Counter[str]:
    """How often each name is read."""
    return Counter(n.id for n in ast.walk(definition) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Load))
