"""From a scalar body to text of a shading language.

`lower` has done the thinking: loops are unrolled, known arguments folded, constants named. What is left is arithmetic,
choices and calls, and each is spelled here as the language has it. So a shader computes what was measured, operation by
operation; only the few primitives (powers, exponentials, bits of floats) are the language's own.
"""

import ast
import inspect
from collections.abc import Callable
from itertools import count
from typing import Any

import numpy as np

from phongbench.compiler import elementary, float_bits
from phongbench.compiler.lowering import FLOAT32, Body, lower
from phongbench.errors import KernelError
from phongbench.formulas.shader_code.languages import BUILT_IN, Language

#: primitive -> what it is, in the words of GLSL; `float_bits` and `bits_float` read a float as a whole number and back
PRIMITIVES: dict[Body, str] = {
    elementary.power: "_select(x > 0.0, pow(x, y), 0.0)",
    elementary.exponential: "exp(x)",
    elementary.exp2: "exp2(t)",
    elementary.square_root: "sqrt(x)",
    elementary.arc_cosine: "acos(min(max(x, -1.0), 1.0))",
    float_bits.binary_exponent: "floor(log2(x) + 0.5)",
    float_bits.binary_mantissa: "x / exp2(floor(log2(x) + 0.5))",
    float_bits.shifted: "round(t)",
    float_bits.unshifted: "s",
    float_bits.scaled: "x * exp2(s)",
    elementary.linear_log2: "_cast(_int_difference(float_bits(x), 1065353216)) / 8388608.0",
    float_bits.from_linear: "bits_float(_int_sum(_index(t * 8388608.0), 1065353216))",
    elementary.linear_exp2: (
        "_select(t < -126.0, 0.0, bits_float(_int_sum(_index(min(max(t, -126.0), 127.0) * 8388608.0), 1065353216)))"
    ),
}

_CHOICE, _OR, _AND, _ORDER, _SUM, _PRODUCT, _SIGN, _ATOM = range(8)
_OPERATORS: dict[type[ast.AST], tuple[str, int]] = {
    ast.Add: ("+", _SUM),
    ast.Sub: ("-", _SUM),
    ast.Mult: ("*", _PRODUCT),
    ast.Div: ("/", _PRODUCT),
    ast.Lt: ("<", _ORDER),
    ast.LtE: ("<=", _ORDER),
    ast.Gt: (">", _ORDER),
    ast.GtE: (">=", _ORDER),
    ast.Eq: ("==", _ORDER),
    ast.NotEq: ("!=", _ORDER),
    ast.And: ("&&", _AND),
    ast.Or: ("||", _OR),
}


class Speller:
    """Writes bodies and what they call as functions of one language, each once, callees first.

    table      the values of the only table a formula may have, or None
    functions  text of the functions so far, in the order they must stand
    """

    def __init__(self, language: Language, table: Any = None) -> None:
        self.language, self.table = language, table
        self.functions: list[str] = []
        self._names: dict[Any, str] = {}

    def function(self, body: Body, **known: int) -> str:
        """Write the body with these known arguments, and what it calls; the name of its function.

        Raises KernelError for a body that cannot be lowered or calls a primitive without spelling.
        """
        key = (body, tuple(sorted(known.items())))
        if key in self._names:
            return self._names[key]
        words = [body.__name__, *(f"{k}{v}" for k, v in known.items())]
        name = self._unused(self.language.word("_".join(words).replace("-", "m")))
        text = self._primitive(body, name) if hasattr(body, "__implementations__") else self._plain(body, name, known)
        self.functions.append(text)
        self._names[key] = name
        return name

    def helper(self, name: str) -> None:
        """Put a function that the language lacks in front."""
        if name in self.language.helpers and name not in self._names:
            self.functions.append(self.language.helpers[name])
            self._names[name] = name

    def _unused(self, name: str) -> str:
        taken = {"highlight", *BUILT_IN, *self._names.values()}
        others = (f"{name}_{number}" for number in count(2))
        return name if name not in taken else next(other for other in others if other not in taken)

    def _plain(self, body: Body, name: str, known: dict[str, int]) -> str:
        lowered: Any = lower(body, FLOAT32, **known)
        definition = ast.parse(lowered.__lowered_source__).body[0]
        assert isinstance(definition, ast.FunctionDef)
        return _Function(self, lowered.__globals__, lowered.__callees__).text(definition, name, _first_line(body))

    def _primitive(self, body: Body, name: str) -> str:
        if body not in PRIMITIVES:
            fix = f"add it to PRIMITIVES in {__name__}"
            raise KernelError(f"{body.__name__} has no spelling outside Python", None, fix)
        arguments = ", ".join(inspect.signature(body).parameters)
        definition = ast.parse(f"def primitive({arguments}):\n    return {PRIMITIVES[body]}").body[0]
        assert isinstance(definition, ast.FunctionDef)
        return _Function(self, {}, {}).text(definition, name, _first_line(body))


class _Function:
    """One function: the kinds of its names ("float", "int"), and its expressions as (text, binding, kind)."""

    def __init__(self, speller: Speller, scope: dict[str, Any], callees: dict[str, Body]) -> None:
        self.speller, self.language, self.scope, self.callees = speller, speller.language, scope, callees
        self.kinds: dict[str, str] = {}

    def text(self, definition: ast.FunctionDef, name: str, comment: str) -> str:
        """The whole function, with a comment."""
        given = [a.arg for a in definition.args.args if a.arg != "table"]
        self.kinds = dict.fromkeys(given, "float")
        assigned = {n.id for n in ast.walk(definition) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)}
        # arguments cannot change in every language: one that does is taken under another name
        taken = {a: f"{self.language.word(a)}_given" if a in assigned else self.language.word(a) for a in given}
        copies = [
            self.language.declared(self.language.float_type, self.language.word(a), taken[a])
            for a in given
            if a in assigned
        ]
        lines = copies + [self._statement(s) for s in definition.body]
        kind = self.language.float_type
        header = self.language.header(kind, name, [(kind, taken[a]) for a in given])
        body = "\n".join(f"    {line}" for line in lines)
        return f"// {comment}\n{header} {{\n{body}\n}}"

    def _statement(self, node: ast.stmt) -> str:
        match node:
            case ast.Return(value=ast.expr() as value):
                return f"return {self._expression(value)[0]};"
            case ast.Assign(targets=[ast.Name(id=name)], value=value):
                text, _, kind = self._expression(value)
                word = self.language.word(name)
                if name in self.kinds:
                    return f"{word} = {text};"
                self.kinds[name] = kind
                types = {"float": self.language.float_type, "int": self.language.integer_type}
                return self.language.declared(types[kind], word, text)
        raise KernelError(f"`{ast.unparse(node)}` has no spelling in {self.language.name}")

    def _expression(self, node: ast.expr) -> tuple[str, int, str]:
        match node:
            case ast.Constant(value=bool() as value):
                return str(value).lower(), _ATOM, "bool"
            case ast.Constant(value=int() as value):
                return str(value), _ATOM if value >= 0 else _SIGN, "int"
            case ast.Constant(value=float() as value):
                return self._number(value)
            case ast.Name(id=name) if name in self.kinds:
                return self.language.word(name), _ATOM, self.kinds[name]
            case ast.Name(id=name) if name in self.scope:
                return self._number(float(self.scope[name]))
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                return f"-{self._within(operand, _ATOM)}", _SIGN, self._expression(operand)[2]
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                return f"!{self._within(operand, _ATOM)}", _SIGN, "bool"
            case ast.BinOp(left=left, op=op, right=right):
                sign, binding = _OPERATORS[type(op)]
                # the order of roundings is part of the formula: a right operand that binds no closer keeps its brackets
                text = f"{self._within(left, binding)} {sign} {self._within(right, binding + 1)}"
                return text, binding, self._expression(left)[2]
            case ast.Compare(left=left, ops=ops, comparators=rest):
                return self._comparison([left, *rest], ops)
            case ast.BoolOp(op=op, values=values):
                sign, binding = _OPERATORS[type(op)]
                return f" {sign} ".join(self._within(v, binding + 1) for v in values), binding, "bool"
            case ast.Call(func=ast.Name(id=name), args=arguments):
                return self._call(name, arguments)
        raise KernelError(f"`{ast.unparse(node)}` has no spelling in {self.language.name}")

    def _within(self, node: ast.expr, binding: int) -> str:
        text, own, _ = self._expression(node)
        return text if own >= binding else f"({text})"

    def _number(self, value: float) -> tuple[str, int, str]:
        if not np.isfinite(np.float32(value)):
            raise KernelError(f"the constant {value} is not a finite float32", None, "shading languages have no other")
        return self.language.number(value), _ATOM if value >= 0 else _SIGN, "float"

    def _comparison(self, parts: list[ast.expr], ops: list[ast.cmpop]) -> tuple[str, int, str]:
        pairs = [
            f"{self._within(left, _SUM)} {_OPERATORS[type(op)][0]} {self._within(right, _SUM)}"
            for left, op, right in zip(parts, ops, parts[1:], strict=False)
        ]
        return " && ".join(pairs), _ORDER if len(pairs) == 1 else _AND, "bool"

    def _call(self, name: str, arguments: list[ast.expr]) -> tuple[str, int, str]:
        if name == "_select":
            condition, yes, no = (self._within(a, _OR) for a in arguments)
            text = self.language.chosen(condition, yes, no)
            return text, _CHOICE if "?" in text else _ATOM, self._expression(arguments[1])[2]
        if name in ("_int_sum", "_int_difference"):
            sign = {"_int_sum": "+", "_int_difference": "-"}[name]
            return f"{self._within(arguments[0], _SUM)} {sign} {self._within(arguments[1], _PRODUCT)}", _SUM, "int"
        if name == "_entry":
            return f"TABLE[{self._expression(arguments[1])[0]}]", _ATOM, "float"
        if name == "len":
            return str(len(self.speller.table)), _ATOM, "int"
        if name == "_index" and self._expression(arguments[0])[2] == "int":  # arithmetic of whole numbers is theirs
            return self._expression(arguments[0])
        kind = "int" if name in ("_index", "float_bits") else "float"
        called = {"_index": "int", "_cast": "float"}.get(name, name)
        passed = ", ".join(self._expression(a)[0] for a in arguments if not _is_table(a))
        if name in self.callees:
            callee, known = self.callees[name], getattr(self.scope[name], "__known__", {})
            return f"{self.speller.function(callee, **known)}({passed})", _ATOM, "float"
        self.speller.helper(called)
        return f"{self.language.names.get(called, called)}({passed})", _ATOM, kind


def _is_table(node: ast.expr) -> bool:
    return isinstance(node, ast.Name) and node.id == "table"


def _first_line(body: Callable[..., Any]) -> str:
    """What a body says of itself, in one line."""
    return (inspect.getdoc(body) or body.__name__).partition("\n")[0]
