"""One scalar body, every working precision.

A formula is written once, as a plain Python function of numbers. That function, run on Python floats or mpmath numbers,
is its own oracle. `lower` reads its source and writes the same function for a working precision:

- literals and constants get the working precision (a bare 1.0 would silently promote float32 to float64);
- in float16, bfloat16 and fixed point every operation is rounded, as a unit of that precision would do it;
- arguments annotated `int` are known when compiling: loops over range(n) unroll, tests on them fold;
- calls to other bodies are lowered likewise; primitives are replaced by their implementation for the precision.

The language: assignments, conditional expressions, arithmetic + - * /, comparisons, `for` over a known range, `if` on
known values, subscripts of tables, abs, int, float, len, and calls. Anything else is refused with the line it stands
on.
"""

import ast
import inspect
import linecache
import textwrap
from functools import cache
from typing import Any

import numpy as np

from phongbench.compiler import intrinsics, jit
from phongbench.compiler.kernel_source import Body, Table, known_arguments, native, parsed, primitive, text_of
from phongbench.compiler.precisions import FLOAT16, FLOAT32, FLOAT64, PRECISIONS, Precision, precision_named
from phongbench.errors import KernelError

#: precisions and the marks of the language stand in modules of their own; who lowers needs all three
__all__ = [
    "FLOAT16", "FLOAT32", "FLOAT64", "PRECISIONS", "Body", "Precision", "Table", "known_arguments", "lower", "native",
    "parsed", "precision_named", "primitive",
]  # fmt: skip


@cache
def lower(body: Body, precision: Precision, **known: int) -> Body:
    """The body for a working precision, with its `int` arguments bound; ready to be called from compiled code.

    body       Body       plain Python function in the small language above
    precision  Precision  working precision
    known      int        a value for each argument annotated int
    Raises KernelError naming the file and line of what cannot be lowered.
    """
    return _Lowering(body, precision, known).function()


class _Lowering:
    """Partial evaluation of one body. `kind` of an expression is "int", "float", "bool" or "table"."""

    def __init__(self, body: Body, precision: Precision, known: dict[str, int]) -> None:
        self.body, self.precision, self.text = body, precision, text_of(body)
        self.given, self.known = known, dict[str, Any](known)
        self.kinds: dict[str, str] = {}
        rounding, more = precision.rounding or (None, ())
        self.rounding = {f"_r{i}": value for i, value in enumerate(more)}
        #: name in the lowered source -> the plain body that it calls
        self.callees: dict[str, Body] = {}
        self.namespace: dict[str, Any] = {
            # without a name, numba's cache searches every module for the function: 10 ms a kernel
            "__name__": body.__module__,
            "_round": rounding,
            **self.rounding,
            "_product": precision.product,
            "_cast": precision.carrier.type,
            "_index": np.int32,
            "_select": intrinsics.select,
            "_entry": intrinsics.entry,
        }

    def function(self) -> Body:
        missing = [n for n in known_arguments(self.body) if n not in self.known]
        if missing:
            raise KernelError(f"{self.body.__name__} needs a known value of {', '.join(missing)}")
        arguments = [a.arg for a in self.text.definition.args.args if a.arg not in self.known]
        for a in self.text.definition.args.args:
            annotation = ast.unparse(a.annotation) if a.annotation else "float"
            self.kinds[a.arg] = "table" if annotation.endswith("Table") else "float"
        words = [self.body.__name__, self.precision.name, *(f"{k}{v}" for k, v in self.known.items())]
        name = "_".join(words).replace("-", "m").replace(".", "_")
        statements = self._block(self.text.definition.body)
        text = f"def {name}({', '.join(arguments)}):\n" + textwrap.indent(
            "\n".join(map(ast.unparse, statements)), "    "
        )
        filename = f"<{self.body.__module__}.{name}>"
        linecache.cache[filename] = (len(text), None, text.splitlines(True), filename)
        exec(compile(text, filename, "exec"), self.namespace)
        lowered: Body = self.namespace[name]
        lowered.__lowered_source__ = text  # type: ignore[attr-defined]
        lowered.__callees__ = self.callees  # type: ignore[attr-defined]
        lowered.__known__ = {n: self.given[n] for n in known_arguments(self.body)}  # type: ignore[attr-defined]
        return jit.inline(lowered, self.precision.carrier)

    # statements

    def _block(self, statements: list[ast.stmt]) -> list[ast.stmt]:
        return [done for statement in statements for done in self._statement(statement)]

    def _statement(self, node: ast.stmt) -> list[ast.stmt]:
        match node:
            case ast.Expr(value=ast.Constant(value=str())):
                return []
            case ast.Return(value=ast.expr() as value):
                return [ast.Return(self._float(value))]
            case (
                ast.Assign(targets=[ast.Name(id=target)], value=value)
                | ast.AnnAssign(target=ast.Name(id=target), value=ast.expr() as value)
            ):
                return self._assign(target, value)
            case ast.AugAssign(target=ast.Name(id=target), op=op, value=value):
                return self._assign(target, ast.copy_location(ast.BinOp(ast.Name(target, ast.Load()), op, value), node))
            case ast.If(test=test, body=body, orelse=orelse):
                return self._block(body if self._known_value(test, "the test of an if") else orelse)
            case ast.For(
                target=ast.Name(id=target), iter=ast.Call(func=ast.Name(id="range"), args=bounds), body=body, orelse=[]
            ):
                done: list[ast.stmt] = []
                for step in range(*(self._known_value(b, "the bound of a range") for b in bounds)):
                    self.known[target] = step
                    done += self._block(body)
                return done
        raise self.text.refusal(node, f"a {type(node).__name__} statement")

    def _assign(self, target: str, value: ast.expr) -> list[ast.stmt]:
        folded, number = self._fold(value)
        if folded and isinstance(number, int) and not isinstance(number, bool):
            self.known[target] = number
            return []
        expression, kind = self._expression(value)
        self.known.pop(target, None)
        self.kinds[target] = kind
        return [ast.fix_missing_locations(ast.Assign([ast.Name(target, ast.Store())], expression, lineno=1))]

    # expressions

    def _float(self, node: ast.expr) -> ast.expr:
        return self._as_float(self._expression(node))

    def _as_float(self, typed: tuple[ast.expr, str]) -> ast.expr:
        """The expression as a float of the working precision; a known integer becomes a constant."""
        expression, kind = typed
        if kind != "int":
            return expression
        if isinstance(expression, ast.Constant) and isinstance(expression.value, int):
            return self._constant(expression.value)
        return self._rounded(_call("_cast", expression))

    def _rounded(self, expression: ast.expr) -> ast.expr:
        """The expression with its result rounded to the working precision, where that is not the carrier's own."""
        if not self.precision.rounds:
            return expression
        return _call("_round", expression, *(ast.Name(name, ast.Load()) for name in self.rounding))

    def _expression(self, node: ast.expr) -> tuple[ast.expr, str]:
        folded, number = self._fold(node)
        if folded:
            whole = isinstance(number, int) and not isinstance(number, bool)
            return (ast.Constant(number), "int") if whole else (self._constant(number), "float")
        match node:
            case ast.Name(id=name) if name in self.kinds:
                return ast.Name(name, ast.Load()), self.kinds[name]
            case ast.BinOp(op=ast.Add() | ast.Sub() | ast.Mult() | ast.Div()):
                return self._arithmetic(node)
            case ast.UnaryOp(op=ast.USub() | ast.Not() as op, operand=operand):
                inner, kind = self._expression(operand)
                return ast.UnaryOp(op, inner), kind
            case ast.Compare(left=left, ops=ops, comparators=rest):
                parts = [self._expression(part) for part in (left, *rest)]
                whole = all(kind == "int" for _, kind in parts)
                done = [part for part, _ in parts] if whole else [self._as_float(part) for part in parts]
                return ast.Compare(done[0], ops, done[1:]), "bool"
            case ast.BoolOp(op=op, values=values):
                return ast.BoolOp(op, [self._expression(v)[0] for v in values]), "bool"
            case ast.IfExp(test=test, body=yes, orelse=no):
                return self._choice(test, yes, no)
            case ast.Subscript(value=ast.Name(id=name), slice=index) if self.kinds.get(name) == "table":
                return _call("_entry", ast.Name(name, ast.Load()), self._expression(index)[0]), "float"
            case ast.Call(func=function, args=arguments, keywords=[]):
                return self._call(node, function, arguments)
        raise self.text.refusal(node, f"`{ast.unparse(node)}`")

    def _arithmetic(self, node: ast.BinOp) -> tuple[ast.expr, str]:
        left, right = self._expression(node.left), self._expression(node.right)
        if left[1] == right[1] == "int" and not isinstance(node.op, ast.Div):
            return _call("_index", ast.BinOp(left[0], node.op, right[0])), "int"
        if self.precision.product and isinstance(node.op, ast.Mult):
            return _call("_product", self._as_float(left), self._as_float(right)), "float"
        return self._rounded(ast.BinOp(self._as_float(left), node.op, self._as_float(right))), "float"

    def _choice(self, test: ast.expr, yes: ast.expr, no: ast.expr) -> tuple[ast.expr, str]:
        folded, truth = self._fold(test)
        if folded:
            return self._expression(yes if truth else no)
        condition, first, second = self._expression(test)[0], self._expression(yes), self._expression(no)
        if first[1] == second[1] == "int":
            return _call("_select", condition, first[0], second[0]), "int"
        chosen = _call("_select", condition, self._as_float(first), self._as_float(second))
        # a constant has any size, but what is chosen must fit into fixed point
        return (self._rounded(chosen) if self.precision.saturates else chosen), "float"

    def _call(self, node: ast.Call, function: ast.expr, arguments: list[ast.expr]) -> tuple[ast.expr, str]:
        callee = self.text.resolve(function)
        if callee is abs:
            return _call("abs", self._float(arguments[0])), "float"
        if callee is len and isinstance(arguments[0], ast.Name):
            return _call("_index", _call("len", ast.Name(arguments[0].id, ast.Load()))), "int"
        if callee is int:
            return _call("_index", self._float(arguments[0])), "int"
        if callee is float:
            return self._float(arguments[0]), "float"
        if not inspect.isfunction(callee):
            raise self.text.refusal(node, f"a call of {ast.unparse(function)}")
        return self._call_body(node, callee, arguments)

    def _call_body(self, node: ast.Call, callee: Body, arguments: list[ast.expr]) -> tuple[ast.expr, str]:
        names = list(inspect.signature(callee).parameters)
        if len(names) != len(arguments):
            raise self.text.refusal(
                node, f"a call of {callee.__name__} with {len(arguments)} arguments instead of {len(names)}"
            )
        bound = {
            n: self._known_value(a, f"argument {n} of {callee.__name__}")
            for n, a in zip(names, arguments, strict=True)
            if n in known_arguments(callee)
        }
        implementations = getattr(callee, "__implementations__", None)
        if implementations is None:
            target, rounds = lower(callee, self.precision, **bound), False
        else:
            target, rounds = self._implementation(callee, implementations, bound), self.precision.rounds
        name = f"{target.__name__}_{len(self.namespace)}"  # two modules may have helpers of the same name
        self.namespace[name], self.callees[name] = target, callee
        passed = [
            self._expression(a)[0] if self._is_table(a) else self._float(a)
            for n, a in zip(names, arguments, strict=True)
            if n not in bound
        ]
        result = _call(name, *passed)
        return (self._rounded(result) if rounds else result), "float"

    def _implementation(self, callee: Body, implementations: dict[str, Body], bound: dict[str, int]) -> Body:
        working = FLOAT32 if self.precision.carrier == FLOAT32.carrier else FLOAT64
        body = implementations[working.name]
        return body if getattr(body, "__compiled__", False) else lower(body, working, **bound)

    # what is known when compiling

    def _fold(self, node: ast.expr) -> tuple[bool, Any]:
        """(True, value) if every name in the expression is known now."""
        names = {n.id for n in ast.walk(node) if isinstance(n, ast.Name)}
        if any(n in self.kinds and n not in self.known for n in names):
            return False, None
        value = self.text.value(node, self.known)
        return isinstance(value, int | float | bool | np.number), value

    def _known_value(self, node: ast.expr, what: str) -> int:
        folded, value = self._fold(node)
        if not folded:
            raise self.text.refusal(node, f"{what} is not known when compiling: `{ast.unparse(node)}`")
        return int(value)

    def _constant(self, value: float) -> ast.expr:
        name = f"_c{len(self.namespace)}"
        self.namespace[name] = self.precision.constant(float(value))
        return ast.Name(name, ast.Load())

    def _is_table(self, node: ast.expr) -> bool:
        return isinstance(node, ast.Name) and self.kinds.get(node.id) == "table"


def _call(name: str, *arguments: ast.expr) -> ast.Call:
    return ast.Call(ast.Name(name, ast.Load()), list(arguments), [])
