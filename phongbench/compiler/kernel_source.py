"""The kernel language as it is written: how helpers are marked, and what a scalar body says in its source."""

import ast
import inspect
import textwrap
import threading
from collections.abc import Callable, Mapping
from functools import cache
from typing import Any, TypeVar

from phongbench.compiler import jit
from phongbench.compiler.precisions import Array
from phongbench.errors import KernelError

Body = Callable[..., Any]
F = TypeVar("F", bound=Body)
#: annotation of a kernel argument that is a one-dimensional table in the working precision
Table = Array
_PARSING = threading.Lock()


def parsed(source: str) -> ast.Module:
    """The syntax tree of a source, made by one thread at a time.

    CPython 3.11 keeps the depth that it has reached in a place that all threads share. Where a finalizer lets another
    thread in, both raise SystemError: AST constructor recursion depth mismatch.
    """
    with _PARSING:
        return ast.parse(source)


def primitive(**implementations: Body) -> Callable[[F], F]:
    """Mark a body as primitive: compiled code uses the implementation named after the precision.

    The decorated plain body stays the definition, and the oracle. An emulated precision uses its carrier's
    implementation, rounded once.
    """

    def mark(body: F) -> F:
        body.__implementations__ = implementations  # type: ignore[attr-defined]
        return body

    return mark


def native(result: Any) -> Callable[[F], F]:
    """Mark an implementation of a primitive whose types are spelled out: it is compiled as it is, not lowered.

    result  NumPy's type of what it takes and returns
    """

    def mark(function: F) -> F:
        function.__compiled__ = True  # type: ignore[attr-defined]
        return jit.inline(function, result)

    return mark


@cache
def known_arguments(body: Body) -> tuple[str, ...]:
    """Names of the arguments that must be known when compiling: those annotated int."""
    return tuple(n for n, p in inspect.signature(body).parameters.items() if p.annotation in (int, "int"))


@cache
def text_of(body: Body) -> "BodyText":
    """Its source, read once for all precisions and known arguments."""
    return BodyText(body)


class BodyText:
    """The source of a plain Python function.

    definition  ast.FunctionDef  its statements
    Raises KernelError for what has no source, or is no plain function.
    """

    def __init__(self, body: Body) -> None:
        self.body = body
        try:
            lines, self._first_line = inspect.getsourcelines(body)
        except (OSError, TypeError) as problem:
            raise KernelError(
                f"the source of {body!r} cannot be read", None, "define the kernel in a file"
            ) from problem
        tree = parsed(textwrap.dedent("".join(lines))).body[0]
        if not isinstance(tree, ast.FunctionDef):
            raise KernelError(f"{body!r} is not a plain function", None, "define the kernel with def")
        self.definition = tree
        self._scope = {**vars(__import__("builtins")), **body.__globals__, **inspect.getclosurevars(body).nonlocals}

    def value(self, node: ast.expr, known: Mapping[str, Any]) -> Any:
        """What an expression is where the body stands, given its names that are known; a refusal if it has no value."""
        scope = {**self._scope, **known}
        try:
            return eval(compile(ast.fix_missing_locations(ast.Expression(node)), "<known>", "eval"), scope)
        except (ArithmeticError, AttributeError, LookupError, NameError, TypeError, ValueError) as problem:
            raise self.refusal(node, f"`{ast.unparse(node)}` ({problem})") from problem

    def resolve(self, function: ast.expr) -> Any:
        """What is called by this name."""
        try:
            return eval(ast.unparse(function), dict(self._scope))
        except (NameError, AttributeError) as problem:
            raise self.refusal(function, str(problem)) from problem

    def refusal(self, node: ast.AST, what: str) -> KernelError:
        """The error that names file and line of what cannot be compiled, and what can."""
        line = self._first_line + getattr(node, "lineno", 1) - 1
        where = f"{inspect.getsourcefile(self.body)}:{line}"
        return KernelError(
            f"{what} cannot be compiled in the kernel {self.body.__name__}",
            where,
            "kernels use + - * /, comparisons, conditional expressions and helpers of phongbench.compiler.elementary",
        )
