"""Everything phongbench knows about numba: compilation, caching, vector width, and the few bit-level operations.

No other module names a numba flag. Three ways to compile:

inline     a scalar body, inlined into whatever loop calls it
elementwise  a C-callable loop over arrays, handed to drivers as a function pointer, so that a driver compiles once
driver     a loop over chunks and cells, free of the GIL
reduction  a loop that sums and maximises; the only place where additions may be reordered

Setting NUMBA_DISABLE_JIT=1 runs everything as plain Python, which is slow and exactly what the tests of the bodies want.
"""

import hashlib
import os
import shutil
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any, TypeVar


def _prefer_wide_vectors() -> None:
    """Let LLVM use 512-bit vectors where the CPU has them; it prefers 256 bits by default.

    Must happen before numba is imported. Measured on a Sapphire Rapids core: float64 loops 1.05 to 1.3 times faster, nothing slower.
    A user's own NUMBA_CPU_NAME wins.
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

import llvmlite  # noqa: E402  the vector width must be chosen first
import numba  # noqa: E402
import numpy as np  # noqa: E402
import platformdirs  # noqa: E402
from llvmlite import ir  # noqa: E402
from numba import types  # noqa: E402
from numba.core import event  # noqa: E402
from numba.extending import intrinsic, overload, register_jitable  # noqa: E402

DISABLED = bool(numba.config.DISABLE_JIT)
#: Fused multiply-adds are what every target has; nothing else may change the arithmetic of a formula.
FORMULA_FLAGS = {"contract"}
#: Sums may be reordered into vector lanes; values are finite by then.
REDUCTION_FLAGS = {"contract", "reassoc", "nsz"}
_KEEP_SECONDS = 30 * 86400

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
    for fact in (sys.version, numba.__version__, llvmlite.__version__, np.__version__, os.environ.get("NUMBA_CPU_NAME", "host")):
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


def _cached(decorate: Callable[[], Any]) -> Any:
    """Run a decorator with numba's cache pointed at our folder, and leave the user's setting as it was."""
    before = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(cache_folder())
    try:
        return decorate()
    finally:
        numba.config.CACHE_DIR = before


def inline(function: F) -> F:
    """Make a scalar function callable from compiled code; LLVM inlines it."""
    return function if DISABLED else register_jitable(function)


def driver(function: F) -> F:
    """Compile a loop over chunks and cells at its first call; it runs without the GIL."""
    if DISABLED:
        return function
    return _cached(lambda: numba.njit(nogil=True, cache=True, error_model="numpy", fastmath=FORMULA_FLAGS)(function))


def reduction(function: F) -> F:
    """Compile a summing loop at its first call; its additions may be reordered into vector lanes."""
    if DISABLED:
        return function
    return _cached(lambda: numba.njit(nogil=True, cache=True, error_model="numpy", fastmath=REDUCTION_FLAGS)(function))


def elementwise(signature: Any, function: Callable[..., Any]) -> Any:
    """Compile an element-by-element loop now, as a C-callable that drivers receive as a function pointer."""
    if DISABLED:
        return function
    return _cached(lambda: numba.cfunc(signature, cache=True, error_model="numpy", fastmath=FORMULA_FLAGS)(function))


def code(loop: Any) -> tuple[str, str]:
    """LLVM and assembly text of an elementwise loop, compiled anew: numba keeps no text of what comes from its cache."""
    # numba shows a cfunc's LLVM but neither its assembly nor the function it was made of
    again = numba.cfunc(loop._sig, error_model="numpy", fastmath=FORMULA_FLAGS)(loop._pyfunc)  # noqa: SLF001
    return again._library.get_llvm_str(), again._library.get_asm_str()  # noqa: SLF001


def array_type(dtype: Any, dimensions: int = 1, *, readonly: bool = False) -> Any:
    """numba's type of a C-contiguous array."""
    return types.Array(numba.from_dtype(np.dtype(dtype)), dimensions, "C", readonly=readonly)


def signature(*arguments: Any) -> Any:
    """numba's signature of a function of these types that returns nothing."""
    return types.void(*arguments)


def pointer_type(of: Any) -> Any:
    """numba's type of a function pointer with this signature."""
    return types.FunctionType(of)


def round_to_half(x: Any) -> Any:
    """The nearest float16, held in a float32 (ties to even, overflow to infinity); integers pass unchanged."""
    return x if isinstance(x, int | np.integer) else np.float32(np.float16(x))


@intrinsic
def _truncate_and_extend(typing: Any, x: Any) -> Any:
    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        return builder.fpext(builder.fptrunc(arguments[0], ir.HalfType()), ir.FloatType())

    return types.float32(types.float32), generate


@overload(round_to_half)
def _compiled_round_to_half(x: Any) -> Any:
    def unchanged(x: Any) -> Any:
        return x

    def rounded(x: Any) -> Any:
        return _truncate_and_extend(np.float32(x))

    return unchanged if isinstance(x, types.Integer) else rounded


def half_product(x: Any, y: Any) -> Any:
    """The nearest float16 to the product of two of them, held in a float32.

    Not round_to_half(x * y): where the processor computes in float16 (AVX512-FP16), LLVM narrows that to a half multiplication
    that still may be contracted, and fuses it with the next addition; the rounding between them is lost.
    """
    return np.float32(np.float16(x * y))


@intrinsic
def _multiply_halves(typing: Any, x: Any, y: Any) -> Any:
    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        # numba adds "contract" to operations without flags; "arcp" means nothing to a product and keeps it away
        product = builder.fmul(*arguments, flags=("arcp",))
        return builder.fpext(builder.fptrunc(product, ir.HalfType()), ir.FloatType())

    return types.float32(types.float32, types.float32), generate


@overload(half_product)
def _compiled_half_product(x: Any, y: Any) -> Any:
    def product(x: Any, y: Any) -> Any:
        return _multiply_halves(np.float32(x), np.float32(y))

    return product


def _bit_cast(source: Any, target: Any, plain: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """A function reinterpreting the bits of `source` as `target`, in compiled code and in plain Python."""

    @intrinsic
    def cast(typing: Any, x: Any) -> Any:
        def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
            return builder.bitcast(arguments[0], context.get_value_type(target))

        return target(source), generate

    return plain if DISABLED else cast


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
