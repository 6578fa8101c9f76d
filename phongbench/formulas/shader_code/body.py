"""One body, statement by statement: what its names stand for, and what each expression becomes."""

import ast
import math
import operator
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any

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
        """Give the name this value; what is used more than once gets a variable."""
        self.values[name] = self.writer.named(name, value) if self.uses[name] > 1 else value

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
        if folded is not None:
            return folded
        if isinstance(op, ast.Mult):
            return self.writer.product(left, right)
        kind = "int" if _kind(left) == _kind(right) == "int" else "float"
        # a right operand that binds no closer keeps its brackets
        text = f"{self.writer.within(left, binding)} {sign} {self.writer.within(right, binding + 1)}"
        low = low_of(left) + low_of(right) if isinstance(op, ast.Add) else -math.inf
        return Term(text, binding, kind, low)

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
                    return writer.function("min" if smaller else "max", [yes, no])
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
            case "_cast", [value]:
                return float(value) if isinstance(value, int) else writer.function("float", [value])
            case "_power", [x, y]:
                return self._power(x, y)
            case "clamp", [x, low, high]:
                return writer.clamped(x, low, high)
            case "max", [x, float() as least]:
                return writer.largest(x, least)
        return writer.function(name, values)

    def _power(self, x: Value, y: Value) -> Value:
        """x^y on GPUs, where pow(0, y) is 0 for a positive y and pow of less is nothing."""
        writer = self.writer
        if isinstance(y, float) and y > 0:
            base = writer.largest(x, 0.0)
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


def _kind(value: Value) -> str:
    if isinstance(value, Term):
        return value.kind
    return "int" if isinstance(value, int) and not isinstance(value, bool) else "float"


@lru_cache(1024)
def _uses(definition: ast.FunctionDef) -> Counter[str]:
    """How often each name is read."""
    return Counter(n.id for n in ast.walk(definition) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Load))
