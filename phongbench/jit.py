"""Everything phongbench knows about numba: compilation, caching, vector width, and the few bit-level operations.

No other module names a numba flag. Three ways to compile:

inline     a scalar body, inlined into whatever loop calls it
elementwise  a C-callable loop over arrays, handed to drivers as a function pointer, so that a driver compiles once
driver     a loop over chunks and cells, free of the GIL
reduction  a loop that sums and maximises; the only place where additions may be reordered

Setting NUMBA_DISABLE_JIT=1 runs everything as plain Python, which is slow and exactly what the tests of the bodies
want.
"""

import hashlib
import inspect
import os
import shutil
import sys
import tempfile
import threading
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any, TypeVar


def _prefer_wide_vectors() -> None:
    """Let LLVM use 512-bit vectors where the CPU has them; it prefers 256 bits by default.

    Must happen before numba is imported. Measured on a Sapphire Rapids core: float64 loops 1.05 to 1.3 times faster,
    nothing slower. A user's own NUMBA_CPU_NAME wins.
    """
    if "numba" in sys.modules or "NUMBA_CPU_NAME" in os.environ:
        return
    import llvmlite.binding as llvm

    features = llvm.get_host_cpu_features()
    if features.get("avx512f") and features.get("avx512vl"):
        features["prefer-256-bit"] = False
        os.environ["NUMBA_CPU_NAME"] = llvm.get_host_cpu_name()
        os.environ["NUMBA_CPU_FEATURES"] = features.flatten()


_prefer_wide_vectors()

import filelock  # noqa: E402  the vector width must be chosen first
import llvmlite  # noqa: E402
import llvmlite.binding as llvm  # noqa: E402
import numba  # noqa: E402
import numpy as np  # noqa: E402
import platformdirs  # noqa: E402
from llvmlite import ir  # noqa: E402
from numba import types  # noqa: E402
from numba.core import caching, cgutils, event  # noqa: E402
from numba.core.compiler_lock import global_compiler_lock  # noqa: E402
from numba.core.typing import signature as typing_signature  # noqa: E402
from numba.extending import lower_builtin, register_jitable, type_callable  # noqa: E402

DISABLED = bool(numba.config.DISABLE_JIT)
#: Fused multiply-adds are what every target has; nothing else may change the arithmetic of a formula.
FORMULA_FLAGS = {"contract"}
#: Sums may be reordered into vector lanes; values are finite by then.
REDUCTION_FLAGS = {"contract", "reassoc", "nsz"}
#: vectors of an elementwise loop in flight at once: 4 makes the exact power 14 % (float32) and 17 % (float64) faster in
#: cache, nothing slower; 2 makes it 7 and 9 %
INTERLEAVE = 4
_KEEP_SECONDS = 30 * 86400
_ONE_AT_A_TIME = threading.RLock()
_NUMBAS_FILE = caching.IndexDataCacheFile

#: what numba raises where it cannot compile
CompileError = numba.core.errors.NumbaError

F = TypeVar("F", bound=Callable[..., Any])


@cache
def cache_folder() -> Path:
    """The folder of compiled kernels; its name changes with every source that is compiled, every version, and the CPU.

    numba itself notices changes in the file of a cached function only, not in the helpers it calls.
    """
    digest = hashlib.sha256()
    package = Path(__file__).parent
    for path in sorted(package.rglob("*.py")):
        text = path.read_bytes()
        if b"jit" in text:
            digest.update(path.relative_to(package).as_posix().encode() + b"\0" + text)
    for fact in (
        sys.version,
        numba.__version__,
        llvmlite.__version__,
        np.__version__,
        os.environ.get("NUMBA_CPU_NAME", "host"),
    ):
        digest.update(fact.encode() + b"\0")
    home = Path(os.environ.get("PHONGBENCH_CACHE") or platformdirs.user_cache_dir("phongbench", appauthor=False))
    folder = home / f"kernels-{digest.hexdigest()[:16]}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
    except OSError as problem:
        folder = Path(tempfile.gettempdir()) / f"phongbench-{os.getuid()}" / folder.name
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        warnings.warn(f"cannot write the kernel cache ({problem}); using {folder}", RuntimeWarning, stacklevel=2)
    _forget_old(folder)
    return folder


def _forget_old(current: Path) -> None:
    """Delete kernel folders of other versions that were not used for a month, and mark this one as used."""
    os.utime(current)
    for other in current.parent.glob("kernels-*"):
        if other != current and time.time() - other.stat().st_mtime > _KEEP_SECONDS:
            shutil.rmtree(other, ignore_errors=True)


def _shared_file(cache_path: str, filename_base: str, source_stamp: Any) -> Any:
    """numba's file of compiled code, to which one process at a time adds.

    numba reads the index, picks the next free name, and writes index and code; two processes that do so at once pick
    the same name, and the kernel listed under it may be the other one. Ours are many to an index.
    """
    file = _NUMBAS_FILE(cache_path, filename_base, source_stamp)
    add, lock = file.save, Path(cache_path, f"{filename_base}.lock")

    def save(key: Any, data: Any) -> None:
        with filelock.FileLock(lock):
            add(key, data)

    file.save = save
    return file


def _cached(decorate: Callable[[], Any]) -> Any:
    """Run a decorator with numba's cache in our folder, safe among processes, and leave numba as it was."""
    with _ONE_AT_A_TIME:  # the setting is the process's: another thread would take or restore the wrong one
        before = numba.config.CACHE_DIR
        numba.config.CACHE_DIR, caching.IndexDataCacheFile = str(cache_folder()), _shared_file
        try:
            return decorate()
        finally:
            numba.config.CACHE_DIR, caching.IndexDataCacheFile = before, _NUMBAS_FILE


def inline(function: F) -> F:
    """Make a scalar function callable from compiled code; LLVM inlines it."""
    return function if DISABLED else register_jitable(function)


def _looped(function: F, flags: set[str]) -> F:
    compiled: F = _cached(lambda: numba.njit(nogil=True, cache=True, error_model="numpy", fastmath=flags)(function))
    return compiled


def driver(function: F) -> F:
    """Compile a loop over chunks and cells at its first call; it runs without the GIL."""
    if DISABLED:
        return function
    return _looped(function, FORMULA_FLAGS)


def reduction(function: F) -> F:
    """Compile a summing loop at its first call; its additions may be reordered into vector lanes."""
    if DISABLED:
        return function
    return _looped(function, REDUCTION_FLAGS)


@contextmanager
def _interleaved() -> Iterator[None]:
    """While it lasts, LLVM computes INTERLEAVE vectors side by side, so that one chain fills the waits of another.

    By itself it does so for the shortest loops only. The option belongs to the process: hence the lock, and the way
    back.
    """
    with global_compiler_lock:
        llvm.set_option("phongbench", f"-force-vector-interleave={INTERLEAVE}")
        try:
            yield
        finally:
            llvm.set_option("phongbench", "-force-vector-interleave=0")


def elementwise(signature: Any, function: Callable[..., Any], *, fused: bool = True) -> Any:
    """Compile an element-by-element loop now, as a C-callable that drivers receive as a function pointer.

    fused  False where two loops must agree to the bit: which product of a sum is fused is the compiler's choice, and
           depends on what it lifted out of the loop
    """
    if DISABLED:
        return function
    flags = FORMULA_FLAGS if fused else False
    with _interleaved():
        return _cached(lambda: numba.cfunc(signature, cache=True, error_model="numpy", fastmath=flags)(function))


def code(loop: Any, *, fused: bool = True) -> tuple[str, str]:
    """LLVM and assembly text of an elementwise loop, compiled anew with the flag it was made with.

    Numba keeps no text of what comes from its cache.
    """
    # numba shows a cfunc's LLVM but neither its assembly nor the function it was made of
    with _interleaved():
        flags = FORMULA_FLAGS if fused else False
        again = numba.cfunc(loop._sig, error_model="numpy", fastmath=flags)(loop._pyfunc)  # noqa: SLF001
    return again._library.get_llvm_str(), again._library.get_asm_str()  # noqa: SLF001


def driver_code(function: Any, dtype: Any) -> tuple[str, str]:
    """LLVM and assembly text of a driver that has run on arrays of this type, compiled anew as `code` does."""
    wanted = numba.from_dtype(np.dtype(dtype))
    given = next(s for s in function.signatures if getattr(s[0], "dtype", None) == wanted)
    again = numba.njit(nogil=True, error_model="numpy", fastmath=FORMULA_FLAGS)(function.py_func)
    again.compile(given)
    return again.inspect_llvm(given), again.inspect_asm(given)


def array_type(dtype: Any, dimensions: int = 1, *, readonly: bool = False) -> Any:
    """numba's type of a C-contiguous array; dtype is NumPy's or numba's."""
    member = dtype if isinstance(dtype, types.Type) else numba.from_dtype(np.dtype(dtype))
    return types.Array(member, dimensions, "C", readonly=readonly)


def signature(*arguments: Any) -> Any:
    """numba's signature of a function of these types that returns nothing."""
    return types.void(*arguments)


_PLAIN: list[Callable[..., Any]] = []


def address(loop: Any) -> int:
    """The address of an elementwise loop, an integer that drivers take in arrays; `function_at` makes it callable
    again.

    Handing the loop itself to a driver costs about 5 us for each call: numba works its type out anew every time.
    """
    if not DISABLED:
        return int(loop.address)
    if loop not in _PLAIN:
        _PLAIN.append(loop)
    return _PLAIN.index(loop)


def _operation(answer: Callable[..., Any], generate: Callable[..., Any]) -> Callable[[F], F]:
    """Give a plain Python function a compiled form that costs no compilation of its own.

    answer    numba types of the arguments -> (type of the result, types the arguments are converted to)
    generate  (context, builder, signature, LLVM values) -> LLVM value
    An `overload` would be compiled as a function for every use: a third of the time a kernel takes to compile.
    """

    def mark(plain: F) -> F:
        if DISABLED:
            return plain

        def typed(result: Any, wanted: Any) -> Any:
            return typing_signature(result, *wanted)

        # numba reads the argument names off the typer, so it must spell them out
        names = ", ".join(inspect.signature(plain).parameters)
        typer = eval(f"lambda {names}: typed(*answer({names}))", {"typed": typed, "answer": answer})
        type_callable(plain)(lambda context: typer)
        lower_builtin(plain, types.VarArg(types.Any))(generate)
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


def function_at(signature_of: Callable[[Any], Any]) -> Callable[[Any, Any], Any]:
    """An operation (address, like) -> the function there; its signature follows from the dtype of the array `like`."""

    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        pointer = cgutils.create_struct_proxy(sig.return_type)(context, builder)
        pointer.c_addr = builder.inttoptr(arguments[0], cgutils.voidptr_t)
        pointer.py_addr = pointer.jit_addr = cgutils.get_null_value(cgutils.voidptr_t)
        return pointer._getvalue()  # noqa: SLF001  numba's way of building a struct

    def plain(address: Any, like: Any) -> Any:
        return _PLAIN[address]

    return _operation(
        lambda address, like: (types.FunctionType(signature_of(like.dtype)), (types.intp, like)), generate
    )(plain)


def _bit_cast(source: Any, target: Any, plain: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """A function reinterpreting the bits of `source` as `target`, in compiled code and in plain Python."""
    return _operation(
        lambda x: (target, (source,)),
        lambda context, builder, sig, a: builder.bitcast(a[0], context.get_value_type(target)),
    )(plain)


float32_bits = _bit_cast(types.float32, types.int32, lambda x: np.float32(x).view(np.int32))
float32_from_bits = _bit_cast(types.int32, types.float32, lambda i: np.int32(i).view(np.float32))
float64_bits = _bit_cast(types.float64, types.int64, lambda x: np.float64(x).view(np.int64))
float64_from_bits = _bit_cast(types.int64, types.float64, lambda i: np.int64(i).view(np.float64))


_CLOCK = int(getattr(time, "CLOCK_MONOTONIC", 1))
_clock_gettime = types.ExternalFunction("clock_gettime", types.int32(types.int32, types.intp))


def _nanoseconds(stamp: Any) -> Any:
    """Nanoseconds of the monotonic clock, read inside compiled code so that no Python lies between clock and loop.

    stamp  int64 (2,)  scratch that the clock writes its seconds and nanoseconds to
    """
    _clock_gettime(_CLOCK, stamp.ctypes.data)
    return stamp[0] * 1_000_000_000 + stamp[1]


nanoseconds: Callable[[Any], Any] = (lambda stamp: time.monotonic_ns()) if DISABLED else inline(_nanoseconds)


@contextmanager
def compilations() -> Iterator[list[Any]]:
    """Collects everything numba compiles while the context lasts: an empty list proves that nothing was."""
    with event.install_recorder("numba:compile") as recorder:
        yield recorder.buffer
