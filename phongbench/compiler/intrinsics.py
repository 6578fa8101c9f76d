"""The operations that plain Python lacks and compiled code needs: roundings, bits, unchecked access, calls by address.

Each is a plain Python function, which says what it means, with a few LLVM instructions for compiled code.
"""

import inspect
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

from phongbench.compiler import jit
from phongbench.compiler.late_numba import Late, when_loaded

types: Any = Late("numba.types")
ir: Any = Late("llvmlite.ir")
cgutils: Any = Late("numba.core.cgutils")
numba: Any = Late("numba")

F = TypeVar("F", bound=Callable[..., Any])


def _operation(answer: Callable[..., Any], generate: Callable[..., Any]) -> Callable[[F], F]:
    """Give a plain Python function a compiled form that costs no compilation of its own.

    answer    numba types of the arguments -> (type of the result, types the arguments are converted to)
    generate  (context, builder, signature, LLVM values) -> LLVM value
    An `overload` would be compiled as a function for every use: a third of the time a kernel takes to compile.
    """

    def mark(plain: F) -> F:
        if jit.DISABLED:
            return plain

        def typed(result: Any, wanted: Any) -> Any:
            return numba.core.typing.signature(result, *wanted)

        # numba reads the argument names off the typer, so it must spell them out
        names = ", ".join(inspect.signature(plain).parameters)
        typer = eval(f"lambda {names}: typed(*answer({names}))", {"typed": typed, "answer": answer})

        def register() -> None:
            numba.extending.type_callable(plain)(lambda context: typer)
            numba.extending.lower_builtin(plain, types.VarArg(types.Any))(generate)

        when_loaded(register)
        return plain

    return mark


def _halved(value: Any, builder: Any) -> Any:
    return builder.fpext(builder.fptrunc(value, ir.HalfType()), ir.FloatType())


def _same_or_half(x: Any) -> Any:
    return (x, (x,)) if isinstance(x, types.Integer) else (types.float32, (types.float32,))


@_operation(
    _same_or_half,
    lambda context, builder, sig, a: a[0] if isinstance(sig.return_type, types.Integer) else _halved(a[0], builder),
)
def round_to_half(x: Any) -> Any:
    """The nearest float16, held in a float32 (ties to even, overflow to infinity); integers pass unchanged."""
    return x if isinstance(x, int | np.integer) else np.float32(np.float16(x))


# numba adds "contract" to operations without flags; "arcp" means nothing to a product and keeps it away
@_operation(
    lambda x, y: (types.float32, (types.float32, types.float32)),
    lambda context, builder, sig, a: _halved(builder.fmul(*a, flags=("arcp",)), builder),
)
def half_product(x: Any, y: Any) -> Any:
    """The nearest float16 to the product of two of them, held in a float32.

    Not round_to_half(x * y): where the processor computes in float16 (AVX512-FP16), LLVM narrows that to a half
    multiplication that still may be contracted, and fuses it with the next addition; the rounding between them is lost.
    """
    return np.float32(np.float16(x * y))


def _estimated(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
    root = builder.call(builder.module.declare_intrinsic("llvm.sqrt", [ir.FloatType()]), arguments, fastmath=("fast",))
    return builder.fdiv(ir.FloatType()(1.0), root, flags=("fast",))


@_operation(lambda x: (types.float32, (types.float32,)), _estimated)
def root_estimate(x: Any) -> Any:
    """1/sqrt(x) in float32; by the processor's estimate alone in a loop that says `estimating`."""
    return np.float32(1) / np.sqrt(np.float32(x))


def _marked(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
    set.add(builder.function.attributes, '"reciprocal-estimates"="all:0"')  # llvmlite's own refuses values
    return ir.IntType(64)(0)


@_operation(lambda: (types.int64, ()), _marked)
def estimating() -> int:
    """Said once in a loop's function: its `root_estimate` take no Newton step. On x86 RSQRTPS, within 1.5 * 2^-12."""
    return 0


def _brained(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
    if isinstance(sig.return_type, types.Integer):
        return arguments[0]
    x, word = arguments[0], ir.IntType(32)
    bits = builder.bitcast(x, word)
    odd = builder.and_(builder.lshr(bits, word(16)), word(1))
    near = builder.add(bits, builder.add(odd, word(0x7FFF)))
    quiet = builder.or_(bits, word(0x00400000))
    chosen = builder.select(builder.fcmp_unordered("uno", x, x), quiet, near)
    return builder.bitcast(builder.and_(chosen, word(0xFFFF0000)), ir.FloatType())


@_operation(_same_or_half, _brained)
def round_to_bfloat16(x: Any) -> Any:
    """The nearest bfloat16, held in a float32 (ties to even, overflow to infinity); integers pass unchanged."""
    if isinstance(x, int | np.integer):
        return x
    bits = int(np.float32(x).view(np.uint32))
    near = bits | 0x00400000 if np.isnan(x) else bits + 0x7FFF + (bits >> 16 & 1)
    return np.uint32(near & 0xFFFF0000).view(np.float32)


def _fixed(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
    x, shift, low, high = arguments
    if isinstance(sig.return_type, types.Integer):
        return x
    number = builder.select(builder.fcmp_unordered("uno", x, x), x.type(0.0), x)
    above = builder.select(builder.fcmp_ordered(">", number, low), number, low)
    inside = builder.select(builder.fcmp_ordered("<", above, high), above, high)
    return builder.fsub(builder.fadd(inside, shift), shift)


def _same_or_fixed(x: Any, shift: Any, low: Any, high: Any) -> Any:
    whole = isinstance(x, types.Integer)
    return (x if whole else types.float64, (x if whole else types.float64, *3 * (types.float64,)))


@_operation(_same_or_fixed, _fixed)
def round_to_fixed(x: Any, shift: Any, low: Any, high: Any) -> Any:
    """The nearest multiple of a step within [low, high], ties to even, held in a float64; 0 for NaN.

    shift  float64  1.5 * 2^52 steps: adding and subtracting it rounds to a step
    Integers pass unchanged.
    """
    if isinstance(x, int | np.integer):
        return x
    number = np.float64(0.0) if np.isnan(x) else np.float64(x)
    return np.float64((min(max(number, low), high) + shift) - shift)


@_operation(
    lambda condition, yes, no: (yes, (types.boolean, yes, yes)),
    lambda context, builder, sig, a: builder.select(
        context.cast(builder, a[0], sig.args[0], types.boolean), a[1], a[2]
    ),
)
def select(condition: Any, yes: Any, no: Any) -> Any:
    """`yes` if the condition holds, else `no`, both of one type and both computed.

    A branch would keep a loop from vectorising.
    """
    return yes if condition else no


@_operation(
    lambda table, index: (table.dtype, (table, types.intp)),
    lambda context, builder, sig, a: builder.load(
        builder.gep(context.make_array(sig.args[0])(context, builder, a[0]).data, [a[1]])
    ),
)
def entry(table: Any, index: Any) -> Any:
    """table[index] for an index that is known to be inside."""
    return table[index]


def _store(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
    array, index, value = arguments
    builder.store(value, builder.gep(context.make_array(sig.args[0])(context, builder, array).data, [index]))
    return context.get_dummy_value()


@_operation(lambda array, index, value: (types.none, (array, types.intp, array.dtype)), _store)
def put(array: Any, index: Any, value: Any) -> None:
    """array[index] = value for an index that is known to be inside.

    Where numba cannot see that an index is not negative, it looks at every one, and the loop does not vectorise.
    """
    array[index] = value


def _load_of_three(context: Any, builder: Any, sig: Any, a: Any) -> Any:
    rows, i, component = a
    data = context.make_array(sig.args[0])(context, builder, rows).data
    return builder.load(builder.gep(data, [builder.add(builder.mul(i, ir.Constant(i.type, 3)), component)]))


@_operation(lambda rows, i, component: (rows.dtype, (rows, types.intp, types.intp)), _load_of_three)
def of_three(rows: Any, i: Any, component: Any) -> Any:
    """rows[i, component] of a C-contiguous array of shape (n, 3).

    Only the constant 3 lets LLVM load whole vectors and sort them; with the array's own stride it falls back to single
    values.
    """
    return rows[i, component]


#: entries that a kernel's table may have
MAX_TABLE = 1024


def _copy_to_stack(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
    given = context.make_array(sig.args[0])(context, builder, arguments[0])
    member = context.get_data_type(sig.args[0].dtype)
    local = cgutils.alloca_once(builder, member, size=MAX_TABLE)
    cgutils.raw_memcpy(builder, local, given.data, given.nitems, given.itemsize)
    copied = context.make_array(sig.return_type)(context, builder, value=arguments[0])
    copied.data = local
    copied.meminfo = cgutils.get_null_value(copied.meminfo.type)
    return copied._getvalue()  # noqa: SLF001  numba's way of building a struct


@_operation(lambda table: (table, (table,)), _copy_to_stack)
def on_stack(table: Any) -> Any:
    """A copy of a table of at most MAX_TABLE entries in the function's own frame, which no array can overlap.

    LLVM vectorises a lookup only if it can prove that the loop's output does not overwrite the table: 1.6 to 4 ns
    became 0.4.
    """
    return table


def _bit_cast(source: str, target: str, plain: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """A function reinterpreting the bits of type `source` as `target`, in compiled code and in plain Python."""
    return _operation(
        lambda x: (getattr(types, target), (getattr(types, source),)),
        lambda context, builder, sig, a: builder.bitcast(a[0], context.get_value_type(sig.return_type)),
    )(plain)


float32_bits = _bit_cast("float32", "int32", lambda x: np.float32(x).view(np.int32))
float32_from_bits = _bit_cast("int32", "float32", lambda i: np.int32(i).view(np.float32))
float64_bits = _bit_cast("float64", "int64", lambda x: np.float64(x).view(np.int64))
float64_from_bits = _bit_cast("int64", "float64", lambda i: np.int64(i).view(np.float64))


def function_at(signature_of: Callable[[Any], Any]) -> Callable[[Any, Any], Any]:
    """An operation (address, like) -> the function there; its signature follows from the dtype of the array `like`."""

    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        pointer = cgutils.create_struct_proxy(sig.return_type)(context, builder)
        pointer.c_addr = builder.inttoptr(arguments[0], cgutils.voidptr_t)
        pointer.py_addr = pointer.jit_addr = cgutils.get_null_value(cgutils.voidptr_t)
        return pointer._getvalue()  # noqa: SLF001  numba's way of building a struct

    def plain(address: Any, like: Any) -> Any:
        return jit.uncompiled(address)

    return _operation(
        lambda address, like: (types.FunctionType(signature_of(like.dtype)), (types.intp, like)), generate
    )(plain)
