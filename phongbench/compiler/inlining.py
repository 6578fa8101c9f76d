"""Scalar functions whose type is known, compiled into the loops that call them: half the time of numba's own way.

Through `register_jitable` a function becomes an overload, typed by compiling it, with a wrapper for C and machine code
of its own that nobody calls; of a kernel's compilation that is a quarter. Where the type of the result is known,
nothing has to be compiled to type a call, and only what is linked into the caller is made. What LLVM is given, and so
every value, is the same.
"""

import inspect
from collections.abc import Callable
from typing import Any

import numpy as np

from phongbench.compiler import late_numba

types: Any = late_numba.Late("numba.types")
numba: Any = late_numba.Late("numba")


def register(function: Callable[..., Any], result: Any) -> None:
    """Make a function callable from compiled code, once numba is loaded.

    result  what it returns: NumPy's type of a number, or a tuple of them
    """
    known: dict[Any, Any] = {}

    def typed(*arguments: Any) -> Any:
        return numba.core.typing.signature(_type(result), *map(types.unliteral, arguments))

    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        flags = numba.core.targetconfig.ConfigStack().top().copy()  # the caller's: they decide what may be fused
        flags.no_compile = flags.no_cpython_wrapper = flags.no_cfunc_wrapper = True
        key = (sig, flags.copy())
        if key not in known:
            known[key] = context.compile_subroutine(builder, function, sig, flags=flags, caching=False)
        context.active_code_library.add_linking_library(known[key].library)
        return context.call_internal(builder, known[key].fndesc, sig, arguments)

    # numba reads the argument names off the typer, so it must spell them out
    names = ", ".join(inspect.signature(function).parameters)
    typer = eval(f"lambda {names}: typed({names})", {"typed": typed})
    numba.extending.type_callable(function)(lambda context: typer)
    numba.extending.lower_builtin(function, types.VarArg(types.Any))(generate)


def _type(result: Any) -> Any:
    if isinstance(result, tuple):
        return types.Tuple([_type(member) for member in result])
    return numba.from_dtype(np.dtype(result))
