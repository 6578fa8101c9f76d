"""What the compiled loops of shading are made of: whole vectors."""

import platform
import re
from typing import Any

import numba
import numpy as np
import pytest
from shading_twin import cloud, scene

from phongbench.compiler import jit
from phongbench.compiler.lowering import FLOAT32
from phongbench.formulas.lambda_forms import LAMBDA_FORMS
from phongbench.shading import tile_loop, tiles
from phongbench.shading.light_loops import KINDS, coordinate_loop, facing_loop
from phongbench.shading.shade import shade

pytestmark = pytest.mark.skipif(jit.DISABLED, reason="thousands of points, in plain Python")


x86_only = pytest.mark.skipif(platform.machine().lower() not in ("x86_64", "amd64"), reason="reads x86 instructions")


def packed(assembly: str, type_: str, most: int = 12) -> None:
    """Products and sums of whole vectors; of single values none."""
    assert re.search(rf"\bv(fn?m(add|sub)\d+|mul){type_}\s.*[yz]mm", assembly)
    # what is the same for all points is computed once, and the search for the first bad point need not be fast
    single = [line for line in assembly.splitlines() if re.search(r"\bv(fn?m(add|sub)\d+|div|sqrt)s[sd]\b", line)]
    assert len(single) <= most, single


@x86_only
@pytest.mark.parametrize("kind", KINDS)
def test_the_loops_over_lights_compute_on_whole_vectors(kind: str) -> None:
    for shadowed in (False, True):
        llvm, assembly = jit.code(facing_loop(kind, shadowed, FLOAT32), fused=False)
        packed(assembly, "ps")
        assert not re.search(r"\bdouble\b", llvm)


@x86_only
@pytest.mark.parametrize("space", ["reflect", "half"])
@pytest.mark.parametrize("form", ["none", *LAMBDA_FORMS])
def test_the_loops_over_coordinates_compute_on_whole_vectors(space: str, form: str) -> None:
    for light, viewer in ((False, False), (True, True)):
        llvm, assembly = jit.code(coordinate_loop(space, form, light, viewer, False, FLOAT32), fused=False)
        packed(assembly, "ps")
        assert not re.search(r"\bdouble\b", llvm)


@x86_only
@pytest.mark.parametrize(("dtype", "suffix"), [(np.float32, "ps"), (np.float64, "pd")])
def test_what_is_loaded_added_and_stored_is_whole_vectors_too(dtype: Any, suffix: str) -> None:
    shade(*cloud(10, dtype), **scene())
    loop, wanted = tile_loop.shade_tiles, numba.from_dtype(np.dtype(dtype))
    given = next(s for s in loop.signatures if f"array({wanted}," in str(s[0]))
    again = numba.njit(nogil=True, error_model="numpy", fastmath=jit.FORMULA_FLAGS)(loop.py_func)
    again.compile(given)
    llvm, assembly = again.inspect_llvm(given), again.inspect_asm(given)
    packed(assembly, suffix, most=40)
    assert re.search(rf"\bvsqrt{suffix}\s.*[yz]mm", assembly)
    assert re.search(r"\bvp?(erm|unpck|shuf)\w*\s.*[yz]mm", assembly)  # rows of three are sorted into components
    assert suffix == "pd" or not re.search(r"\bdouble\b", llvm)


def test_a_tile_in_float32_leaves_room_in_the_smallest_second_caches() -> None:
    assert tiles.SCRATCH * FLOAT32.carrier.itemsize <= 64 << 10
    assert tiles.TILE % tiles.BLOCK == 0
