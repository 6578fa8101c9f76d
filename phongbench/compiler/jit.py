"""Compilation by numba: flags, cache, vector width, and loops that drivers call by address.

No other module names a numba flag. Three ways to compile:

inline     a scalar body, inlined into whatever loop calls it
elementwise  a C-callable loop over arrays, handed to drivers as a function pointer, so that a driver compiles once
driver     a loop over chunks and cells, free of the GIL
reduction  a loop that sums and maximises; the only place where additions may be reordered

Setting NUMBA_DISABLE_JIT=1 runs everything as plain Python, which is slow and exactly what the tests of the bodies
want. numba itself is imported when it is first needed (`late_numba`).
"""

import hashlib
import importlib
import os
import platform
import shutil
import sys
import tempfile
import threading
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache, partial, update_wrapper
from pathlib import Path
from typing import Any, TypeVar, cast

import numpy as np
import platformdirs

from phongbench.compiler import inlining, late_numba, templates

numba: Any = late_numba.Late("numba")
types: Any = late_numba.Late("numba.types")
llvm: Any = late_numba.Late("llvmlite.binding")

#: as numba will read it
DISABLED = bool(int(os.environ.get("NUMBA_DISABLE_JIT") or 0))
#: whether there is an instruction that estimates reciprocal roots, of 12 bits or a little more
ESTIMATES_ROOTS = platform.machine().lower() in ("x86_64", "amd64")
#: Fused multiply-adds are what every target has; nothing else may change the arithmetic of a formula.
FORMULA_FLAGS = {"contract"}
#: Sums may be reordered into vector lanes; values are finite by then.
REDUCTION_FLAGS = {"contract", "reassoc", "nsz"}
#: vectors of an elementwise loop in flight at once: 4 makes the exact power 14 % (float32) and 17 % (float64) faster in
#: cache, nothing slower; 2 makes it 7 and 9 %
INTERLEAVE = 4
#: modules that never name the compiler, but that drivers are made of; numba itself sees a change of the bodies that an
#: elementwise loop is a closure over
_BODIES = {
    *(f"compiler/{name}.py" for name in ("kernel_source", "polynomials", "elementary", "tracing", "templates")),
    "formulas/lambda_forms.py",
}
_KEEP_SECONDS = 30 * 86400
_ONE_AT_A_TIME = threading.RLock()

F = TypeVar("F", bound=Callable[..., Any])


def key_of_sources(package: Path) -> str:
    """A digest of what is compiled of a package: every source that names the compiler, and the bodies in _BODIES."""
    digest = hashlib.sha256()
    for path in sorted(package.rglob("*.py")):
        name, text = path.relative_to(package).as_posix(), path.read_bytes()
        if name in _BODIES or b"jit" in text or b"intrinsics" in text:
            digest.update(name.encode() + b"\0" + text)
    return digest.hexdigest()


@cache
def cache_folder() -> Path:
    """The folder of compiled kernels; its name changes with every source that is compiled, every version, and the CPU.

    numba itself notices changes in the file of a cached function only, not in the helpers it calls.
    """
    digest = hashlib.sha256(key_of_sources(Path(__file__).parents[1]).encode())
    for fact in (
        sys.version,
        numba.__version__,
        importlib.import_module("llvmlite").__version__,
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
        user = str(os.getuid()) if hasattr(os, "getuid") else "cache"  # elsewhere the folder is the user's own
        folder = Path(tempfile.gettempdir()) / f"phongbench-{user}" / folder.name
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


def _shared_file(numbas_file: Callable[..., Any], cache_path: str, filename_base: str, source_stamp: Any) -> Any:
    """numba's file of compiled code, to which one process at a time adds.

    numba reads the index, picks the next free name, and writes index and code; two processes that do so at once pick
    the same name, and the kernel listed under it may be the other one. Ours are many to an index.

    numbas_file  numba's class of such files
    """
    file = numbas_file(cache_path, filename_base, source_stamp)
    add, lock = file.save, Path(cache_path, f"{filename_base}.lock")

    def save(key: Any, data: Any) -> None:
        import filelock  # late: who compiles nothing can spare it

        with filelock.FileLock(lock):
            add(key, data)

    file.save = save
    return file


def _cached(decorate: Callable[[], Any]) -> Any:
    """Run a decorator with numba's cache in our folder, safe among processes, and leave numba as it was."""
    with _ONE_AT_A_TIME:  # the setting is the process's: another thread would take or restore the wrong one
        caching = numba.core.caching
        before, file = numba.config.CACHE_DIR, caching.IndexDataCacheFile
        # a loop that is compiled for another comes here again; shared twice, the file would wait for its own lock
        shared = file if isinstance(file, partial) else partial(_shared_file, file)
        numba.config.CACHE_DIR, caching.IndexDataCacheFile = str(cache_folder()), shared
        try:
            return decorate()
        finally:
            numba.config.CACHE_DIR, caching.IndexDataCacheFile = before, file


def inline(function: F, result: Any = None) -> F:
    """Make a scalar function callable from compiled code; LLVM inlines it.

    result  the type of what it returns, where that is known: it is compiled in half the time then, see `inlining`.
            It must then be called with numbers of that type: of others it would give that type all the same
    """
    if not DISABLED and result is None:
        late_numba.when_loaded(lambda: numba.extending.register_jitable(function))
    elif not DISABLED:
        late_numba.when_loaded(lambda: inlining.register(function, result))
    return function


class Loop:
    """A loop that is compiled for the types of each first call; compiled code may call it too.

    What numba's own compiled functions offer, `signatures` and others, it has as well.
    """

    def __init__(self, function: Callable[..., Any], flags: set[str]) -> None:
        update_wrapper(self, function)
        self._function, self._flags = function, flags

    def __call__(self, *arguments: Any) -> Any:
        """Run it, compiled for these arguments' types now if it is not yet."""
        return self._compiled(*arguments)

    def __getattr__(self, name: str) -> Any:  # numba finds its type of a loop so: `_numba_type_`
        if name != "_compiled":
            return getattr(self._compiled, name)
        with _ONE_AT_A_TIME:  # one for all threads, or each would compile its own
            if name not in self.__dict__:
                options = {"nogil": True, "cache": True, "error_model": "numpy", "fastmath": self._flags}
                options["no_cfunc_wrapper"] = True  # nobody calls one from C, or by its address
                self.__dict__[name] = _cached(lambda: numba.njit(**options)(self._function))
            return self.__dict__[name]


def _looped(function: F, flags: set[str]) -> F:
    loop: Any = Loop(function, flags)
    return cast("F", loop)


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
    with numba.core.compiler_lock.global_compiler_lock:
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
    with _interleaved():
        return _cached(lambda: templates.compiled(function, signature, _options(fused)))


def _options(fused: bool) -> dict[str, Any]:
    """How elementwise loops are compiled; none allocates, so none counts references: 4 % of its compilation."""
    return {"error_model": "numpy", "fastmath": FORMULA_FLAGS if fused else False, "_nrt": False}


def code(loop: Any, *, fused: bool = True) -> tuple[str, str]:
    """LLVM and assembly text of an elementwise loop, compiled anew with the flag it was made with.

    Numba keeps no text of what comes from its cache.
    """
    # numba shows a cfunc's LLVM but neither its assembly nor the function it was made of
    with _interleaved():
        again = templates.compiled(loop._pyfunc, loop._sig, _options(fused), cached=False)  # noqa: SLF001
    return again._library.get_llvm_str(), again._library.get_asm_str()  # noqa: SLF001


def array_type(dtype: Any, dimensions: int = 1, *, readonly: bool = False) -> Any:
    """numba's type of a C-contiguous array; dtype is NumPy's or numba's."""
    member = dtype if isinstance(dtype, types.Type) else numba.from_dtype(np.dtype(dtype))
    return types.Array(member, dimensions, "C", readonly=readonly)


def signature(*arguments: Any) -> Any:
    """numba's signature of a function of these types that returns nothing."""
    return types.void(*arguments)


_PLAIN: list[Callable[..., Any]] = []


def address(loop: Any) -> int:
    """The address of an elementwise loop, an integer that drivers take in arrays; `intrinsics.function_at` makes it
    callable again.

    Handing the loop itself to a driver costs about 5 us for each call: numba works its type out anew every time.
    """
    if not DISABLED:
        return int(loop.address)
    if loop not in _PLAIN:
        _PLAIN.append(loop)
    return _PLAIN.index(loop)


def uncompiled(address: int) -> Callable[..., Any]:
    """The loop of this address where the compiler is off."""
    return _PLAIN[address]


def compile_error() -> type[Exception]:
    """What numba raises where it cannot compile."""
    kind: type[Exception] = numba.core.errors.NumbaError
    return kind


@contextmanager
def compilations() -> Iterator[list[Any]]:
    """Collects everything numba compiles while the context lasts: an empty list proves that nothing was."""
    with numba.core.event.install_recorder("numba:compile") as recorder:
        yield recorder.buffer
