"""Loops in C as a careful programmer writes them by hand, compiled here: the bar for our own kernels.

Each takes rows of components and leaves no alias between them, so that the compiler may use every vector instruction
the processor has; with glibc, its powers and exponentials come from libmvec. A pass is one call through ctypes.
"""

import ctypes
import os
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path

from phongbench.compiler.precisions import Array

#: names of the loops
LOOPS = ("phong", "gaussian", "lyon", "lyon_cross")
#: -ffast-math not when linking: a library so linked would flush subnormal numbers of the whole process
_COMPILE = ["-O3", "-march=native", "-ffast-math", "-fopenmp-simd", "-std=c11", "-fPIC", "-c"]
#: compilers take half of the widest vectors unless they are told otherwise; not every processor's takes the option
_WIDEST = "-mprefer-vector-width=512"
_SOURCE = """
#include <math.h>
#define EACH(name, before, value) \\
    void name(long count, const float *restrict ax, const float *restrict ay, const float *restrict az, \\
              const float *restrict bx, const float *restrict by, const float *restrict bz, \\
              float alpha, float *restrict out) { \\
        before \\
        _Pragma("omp simd") \\
        for (long i = 0; i < count; i++) { \\
            float x = ax[i] * bx[i] + ay[i] * by[i] + az[i] * bz[i]; \\
            value \\
        } \\
    }
EACH(phong, , out[i] = x > 0 ? powf(x, alpha) : 0;)
EACH(gaussian, , out[i] = x > 0 ? expf(alpha * x - alpha) : 0;)
EACH(lyon, float beta = alpha / 8;,
    float y = fmaxf(beta * x + (1 - beta), 0); y *= y; y *= y; out[i] = y * y;)
EACH(lyon_cross, float half = alpha / 16;,
    float cx = ay[i] * bz[i] - az[i] * by[i]; float cy = az[i] * bx[i] - ax[i] * bz[i];
    float cz = ax[i] * by[i] - ay[i] * bx[i];
    float y = fmaxf(1 - half * (cx * cx + cy * cy + cz * cz), 0); y *= y; y *= y; out[i] = x > 0 ? y * y : 0;)
"""


def compiled(a: Array, b: Array, out: Array, alpha: float) -> tuple[str, dict[str, Callable[[], Array]]]:
    """The compiler's version, and for each of LOOPS a function that fills `out`, and returns it.

    a, b  (3, n) float32, each row contiguous; Lyon's gamma is 8
    out   (n,) float32
    Raises RuntimeError, saying what to install, without a compiler or where it refuses.
    """
    name = os.environ.get("CC", "cc")
    if (compiler := shutil.which(name)) is None:
        raise RuntimeError(f"there is no C compiler {name!r}; apt's gcc brings cc, and CC names another")
    with tempfile.TemporaryDirectory() as folder:
        library = _built(compiler, Path(folder))
    given = [ctypes.c_long(out.size), *(ctypes.c_void_p(row.ctypes.data) for v in (a, b) for row in v)]
    arguments = (*given, ctypes.c_float(alpha), ctypes.c_void_p(out.ctypes.data))

    def passing(loop: str) -> Callable[[], Array]:
        call = getattr(library, loop)
        call.restype = None

        def once() -> Array:
            call(*arguments)
            return out

        return once

    said = subprocess.run([compiler, "--version"], capture_output=True, text=True, check=False).stdout
    return (said.splitlines() or ["?"])[0], {loop: passing(loop) for loop in LOOPS}


def _built(compiler: str, folder: Path) -> ctypes.CDLL:
    """The loops as a library, which stays open when its file is gone."""
    source, part, library = (str(folder / f"loops.{end}") for end in ("c", "o", "so"))
    Path(source).write_text(_SOURCE)
    compile_it = [*_COMPILE, source, "-o", part]
    if subprocess.run([compiler, _WIDEST, *compile_it], capture_output=True, check=False).returncode:
        _run(compiler, compile_it)
    _run(compiler, ["-shared", part, "-o", library, "-lm"])
    return ctypes.CDLL(library)


def _run(compiler: str, arguments: list[str]) -> None:
    done = subprocess.run([compiler, *arguments], capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"{Path(compiler).name} refuses: {(done.stderr.splitlines() or ['no reason'])[0]}")
