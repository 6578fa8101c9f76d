"""Scalar functions whose type is known, written into the loops that call them: half the time of numba's own way.

Through `register_jitable` a function becomes an overload, typed by compiling it, with a wrapper for C and machine code
of its own that nobody calls; of a kernel's compilation that is a quarter. Where the type of the result is known,
nothing has to be compiled to type a call. A body without branches is written by `tracing`, any other compiled by numba.
"""

import inspect
from collections.abc import Callable
from types import FunctionType
from typing import Any

import numpy as np

from phongbench.compiler import late_numba, tracing

types: Any = late_numba.Late("numba.types")
numba: Any = late_numba.Late("numba")

Body = Callable[..., Any]


class TypedBody:
    """How a body whose result's type is known is written where it is called; `typed` gives that of a function.

    result  what it returns: NumPy's type of a number, or a tuple of them
    """

    def __init__(self, function: Body, result: Any) -> None:
        self.function, self.result = function, result
        self._compiled: dict[Any, Any] = {}
        self._straight = True

    def stand_in(self, write: Callable[..., Any]) -> Body:
        """A function that is typed as this one and written by `write`."""
        of = self.function
        made = FunctionType(of.__code__, of.__globals__, of.__name__, of.__defaults__, of.__closure__)
        _register(made, self.result, write)
        return made

    def write(self, context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        """The LLVM value that it gives for these, written where the builder stands."""
        if self._straight:
            try:
                return self._traced(context, builder, sig, arguments)
            except tracing.UntraceableError:
                self._straight = False
        flags = numba.core.targetconfig.ConfigStack().top().copy()  # the caller's: they decide what may be fused
        flags.no_compile = flags.no_cpython_wrapper = flags.no_cfunc_wrapper = True
        key = (sig, flags.copy())
        if key not in self._compiled:
            made = context.compile_subroutine(builder, self.function, sig, flags=flags, caching=False)
            self._compiled[key] = made
        context.active_code_library.add_linking_library(self._compiled[key].library)
        return context.call_internal(builder, self._compiled[key].fndesc, sig, arguments)

    def _traced(self, context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        given = tracing.Writer(context, builder).run(self.function, sig.args, arguments)
        several = isinstance(given, tuple)
        values, wanted = (given, list(sig.return_type)) if several else ((given,), [sig.return_type])
        if [value.kind for value in values] != wanted:
            computed = ", ".join(str(value.kind) for value in values)
            raise _misused(self.function, f"computes {computed}", sig.return_type)
        if several:
            return context.make_tuple(builder, sig.return_type, [value.llvm for value in values])
        return given.llvm


def register(function: Body, result: Any) -> None:
    """Make a function callable from compiled code, once numba is loaded.

    result  what it returns: NumPy's type of a number, or a tuple of them
    """
    _TYPED[function] = body = TypedBody(function, result)
    _register(function, result, body.write)


def typed(value: Any) -> TypedBody | None:
    """The typed body that a function is; None of everything else."""
    return _TYPED.get(value) if isinstance(value, FunctionType) else None


#: not kept at the functions, whose attributes are part of what numba's cache knows their callers by
_TYPED: dict[Body, TypedBody] = {}


def _register(function: Body, result: Any, write: Callable[..., Any]) -> None:
    """Tell numba how calls of a function are typed, by its result alone, and who writes them."""

    def signature_of(*arguments: Any) -> Any:
        given = tuple(map(types.unliteral, arguments))
        _check(function, result, given)
        return numba.core.typing.signature(_type(result), *given)

    # numba reads the argument names off the typer, so it must spell them out
    names = ", ".join(inspect.signature(function).parameters)
    typer = eval(f"lambda {names}: typed({names})", {"typed": signature_of})
    numba.extending.type_callable(function)(lambda context: typer)
    numba.extending.lower_builtin(function, types.VarArg(types.Any))(write)


def _check(function: Body, result: Any, given: tuple[Any, ...]) -> None:
    """TypingError where a function is called with numbers of another type than its own.

    It would compute in the wider of both, and round its result to its own. Whole numbers are exact in float64.
    """
    own = _type(result[0] if isinstance(result, tuple) else result)
    for kind in given:
        member = getattr(kind, "dtype", kind)
        whole = isinstance(member, types.Integer) and own == types.float64
        if isinstance(member, types.Number) and member != own and not whole:
            raise _misused(function, f"is called with {member}", own)


def _misused(function: Body, what: str, own: Any) -> Exception:
    mend = "lower it for that precision, or inline it without a type if it serves several"
    text = f"{function.__module__}.{function.__qualname__} is compiled for {own} and {what}: {mend}"
    error: Exception = numba.core.errors.TypingError(text)
    return error


def _type(result: Any) -> Any:
    if isinstance(result, tuple):
        return types.Tuple([_type(member) for member in result])
    return numba.from_dtype(np.dtype(result))
