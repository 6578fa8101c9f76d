"""Bodies without branches, written as LLVM instructions by running them: a tenth of the time that numba takes.

A lowered body is straight: its loops are unrolled, its choices made by `select`. Run once on values that write down
what is done to them, it is written down whole. How an operation is typed and written numba itself is asked, so LLVM is
given the instructions that numba would give it, without its parsing, inference and lowering of a function.
"""

import builtins
import operator
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from types import CellType, FunctionType, ModuleType
from typing import Any

import numpy as np

from phongbench.compiler import late_numba

types: Any = late_numba.Late("numba.types")
numba: Any = late_numba.Late("numba")


class UntraceableError(Exception):
    """The body asks for what is known only when it runs, as `if` and `and` do, or for what is no number."""


class Traced:
    """A value of compiled code: its type, and where LLVM keeps it. An operation is written where the builder stands."""

    __slots__ = ("kind", "llvm", "writer")
    __array_ufunc__ = None  # NumPy's numbers leave operations to this class

    def __init__(self, writer: "Writer", kind: Any, llvm: Any) -> None:
        self.writer, self.kind, self.llvm = writer, kind, llvm

    def __bool__(self) -> bool:
        raise UntraceableError


def _operation(function: Callable[..., Any], *, swapped: bool = False) -> Callable[..., Any]:
    def operate(self: Traced, *others: Any) -> Traced:
        return self.writer.call(function, *(*others, self) if swapped else (self, *others))

    return operate


_NAMED = {"and": operator.and_, "or": operator.or_}  # keywords
for _name in ("add", "sub", "mul", "truediv", "and", "or", "xor", "lshift", "rshift"):
    _function = _NAMED.get(_name) or getattr(operator, _name)
    setattr(Traced, f"__{_name}__", _operation(_function))
    setattr(Traced, f"__r{_name}__", _operation(_function, swapped=True))
for _name in ("neg", "lt", "le", "gt", "ge", "eq", "ne"):
    setattr(Traced, f"__{_name}__", _operation(getattr(operator, _name)))
Traced.__hash__ = object.__hash__  # type: ignore[method-assign]  # lost by the definition of ==


def _typing(function: Any, kinds: tuple[Any, ...]) -> tuple[Any, Any]:
    """numba's type of a function and of its call with arguments of these types."""
    typing = numba.core.registry.cpu_target.typing_context
    kind = typing.resolve_value_type(function)
    signature = typing.resolve_function_type(kind, kinds, {})
    if signature is None:
        raise numba.core.errors.TypingError(f"{function!r} does not take {kinds}")
    return kind, signature


_kept_typing = cache(_typing)


class Writer:
    """Writes bodies where a builder of a compilation of numba's stands."""

    def __init__(self, context: Any, builder: Any) -> None:
        self.context, self.builder = context, builder

    def run(self, body: Callable[..., Any], kinds: tuple[Any, ...], arguments: tuple[Any, ...]) -> Any:
        """What the body gives for these LLVM values of these types, a value or a tuple of them, of Traced.

        Raises UntraceableError where it is not straight; what was written until then is used by nothing.
        """
        given = [Traced(self, kind, value) for kind, value in zip(kinds, arguments, strict=True)]
        cells = tuple(CellType(self._known(cell.cell_contents)) for cell in body.__closure__ or ())
        names = {**vars(builtins), **body.__globals__}
        namespace = {name: self._known(names[name]) for name in body.__code__.co_names if name in names}
        traced = FunctionType(body.__code__, {"__builtins__": {}, **namespace}, closure=cells)
        try:
            return traced(*given)
        except (AttributeError, NameError, TypeError, ValueError) as asked:  # numba may know how, or says it better
            raise UntraceableError from asked

    def call(self, function: Any, *arguments: Any) -> Traced:
        """A call of anything that numba compiles."""
        given = [self._value(argument) for argument in arguments]
        # an overload's depends on who calls it; to look an operator's up takes numba longer than all else here
        typing = _typing if isinstance(function, FunctionType) else _kept_typing
        kind, signature = typing(function, tuple(value.kind for value in given))
        cast = self.context.cast
        passed = [cast(self.builder, v.llvm, v.kind, t) for v, t in zip(given, signature.args, strict=True)]
        implementation = self.context.get_function(kind, signature)
        return Traced(self, signature.return_type, implementation(self.builder, passed))

    def _value(self, value: Any) -> Traced:
        """A number that is known now as one of compiled code."""
        if isinstance(value, Traced):
            return value
        if not isinstance(value, int | float | np.number):
            raise UntraceableError
        kind = numba.typeof(value)
        return Traced(self, kind, self.context.get_constant(kind, value))

    def _known(self, value: Any) -> Any:
        """What a body's name stands for while it is traced."""
        if isinstance(value, np.number):
            return self._value(value)
        if isinstance(value, ModuleType):
            return _Members(self._known, value)
        return partial(self.call, value) if callable(value) else value


@dataclass(frozen=True)
class _Members:
    """A module whose members are what they stand for while a body is traced."""

    known: Callable[[Any], Any]
    module: ModuleType

    def __getattr__(self, name: str) -> Any:
        return self.known(getattr(self.module, name))
