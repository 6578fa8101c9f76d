"""Vector kernels: layouts, read-only inputs, gates that change nothing, and the instructions they are made of."""

import math
import platform
import re

import numpy as np
import pytest

from phongbench.compiler import jit
from phongbench.compiler.lowering import FLOAT32, FLOAT64, Precision
from phongbench.errors import InputError
from phongbench.formulas import pair_kernels
from phongbench.formulas.kernel import coefficient_row, highlights, known_values, needs_gate, read_only, table_row
from phongbench.formulas.registry import REGISTRY, example
from phongbench.formulas.spec import Setting
from phongbench.results.schema import LIBM

LYON, PHONG = REGISTRY["lyon"], REGISTRY["phong"]
EIGHT = Setting(50.0, 8, "taylor")
HOSTILE = (math.nan, math.inf, -math.inf, 0.0, -0.0, 1e-40, 1e30, -1e30, 0.5, 1.0)
x86_only = pytest.mark.skipif(
    jit.DISABLED or platform.machine().lower() not in ("x86_64", "amd64"), reason="reads x86 instructions"
)


def vectors(count: int, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Pairs near and far, of all lengths, some of them hostile."""
    rng = np.random.default_rng(seed)
    a = rng.normal(size=(3, count))
    a /= np.linalg.norm(a, axis=0)
    b = a + rng.normal(size=(3, count)) * rng.choice([0.01, 0.1, 3.0], size=count)
    b *= rng.choice([0.1, 0.9, 1.0, 1.1], size=count)
    for column in range(0, count, 7):
        b[:, column] = rng.choice(HOSTILE, size=3)
    return a, b


@pytest.mark.parametrize("precision", [FLOAT32, FLOAT64], ids=["float32", "float64"])
@pytest.mark.parametrize("name", REGISTRY)
def test_vectors_in_rows_and_components_in_rows_give_the_same_bits(name: str, precision: Precision) -> None:
    spec = REGISTRY[name]
    setting = example(spec)
    a, b = vectors(20 if jit.DISABLED else 333)
    with np.errstate(all="ignore"):
        for form in spec.lambda_forms[:2]:
            soa = highlights(spec, form, setting, a, b, precision=precision)
            aos = highlights(spec, form, setting, a.T, b.T, precision=precision, layout="aos")
            assert soa.dtype == precision.carrier
            assert soa.tobytes() == aos.tobytes()


@pytest.mark.parametrize("name", [n for n, spec in REGISTRY.items() if spec.cutoff is not None])
def test_a_kernel_without_its_gate_gives_the_same_bits_on_anything(name: str) -> None:
    spec = REGISTRY[name]
    setting = EIGHT if spec.uses_gamma else Setting(50.0, space=spec.spaces[0])
    assert not needs_gate(spec, "dot", setting)
    a, b = vectors(20 if jit.DISABLED else 3000)
    with np.errstate(all="ignore"):
        found = highlights(spec, "dot", setting, a, b)
        cosine = (a.astype("f4") * b.astype("f4")).sum(axis=0)
    assert not found[~(cosine > -1e-6)].any()
    a32, b32 = (np.ascontiguousarray(v, np.float32) for v in (a, b))
    out = np.empty_like(found)
    gated = pair_kernels.pairs_kernel(spec, "dot", FLOAT32, known_values(spec, setting))
    row, table = coefficient_row(spec, setting, FLOAT32), table_row(spec, setting, FLOAT32)
    with np.errstate(all="ignore"):
        pair_kernels.fill_pairs(jit.address(gated), read_only(a32), read_only(b32), row, table, out)
    assert out.tobytes() == found.tobytes()


@pytest.mark.parametrize(
    ("form", "setting"), [("difference", EIGHT), ("cross", EIGHT), ("tan2", EIGHT), ("dot", Setting(4.0, 8, "taylor"))]
)
def test_forms_that_short_vectors_deceive_and_wide_supports_keep_their_gate(form: str, setting: Setting) -> None:
    assert needs_gate(LYON, form, setting)


def test_a_kernel_that_lights_nan_keeps_its_gate() -> None:
    from dataclasses import replace

    lit = replace(LYON, kernel=lambda cosine_deficit, beta, n: 1.0)
    assert needs_gate(lit, "dot", EIGHT)


@pytest.mark.skipif(jit.DISABLED, reason="nothing is compiled")
def test_read_only_and_writable_inputs_run_the_same_compiled_code() -> None:
    a, b = (np.ascontiguousarray(v, np.float32) for v in vectors(64))
    highlights(LYON, "dot", EIGHT, a, b)
    frozen = a.copy()
    frozen.flags.writeable = False
    with jit.compilations() as compiled:
        highlights(LYON, "dot", EIGHT, frozen, b)
        highlights(LYON, "dot", EIGHT, a, b)
    assert compiled == []
    assert a.flags.writeable


@pytest.mark.parametrize(("layout", "shape"), [("soa", (4, 3)), ("aos", (3, 4)), ("soa", (3,))])
def test_pairs_of_another_shape_are_refused(layout: str, shape: tuple[int, ...]) -> None:
    with pytest.raises(InputError, match="pairs of shape"):
        highlights(LYON, "dot", EIGHT, np.zeros(shape), np.zeros(shape), layout=layout)


def assembly(name: str, form: str, layout: str, setting: Setting) -> tuple[str, str]:
    spec = REGISTRY[name]
    gated = needs_gate(spec, form, setting)
    known = known_values(spec, setting)
    return jit.code(pair_kernels.pairs_kernel(spec, form, FLOAT32, known, layout=layout, gated=gated))


@x86_only
@pytest.mark.parametrize("layout", ["soa", "aos"])
@pytest.mark.parametrize(("name", "form"), [("phong", "none"), *(("lyon", f) for f in ("dot", "difference", "cross"))])
def test_from_vectors_to_highlight_everything_is_packed_float32(name: str, form: str, layout: str) -> None:
    llvm, asm = assembly(name, form, layout, EIGHT if name == "lyon" else Setting(50.0))
    assert re.search(r"\bvfn?m(add|sub)\d+ps\s.*[yz]mm", asm)
    assert not re.search(r"\bdouble\b", llvm)
    assert not re.search(r"\bcall\w*\s+\S*(pow|exp|log)", asm)
    assert not re.search(r"\bv\w+(sd|pd)\b", asm)


@x86_only
def test_libms_power_is_the_call_that_exact_phong_avoids() -> None:
    from phongbench.timing import timed_kernels

    (libm,) = (c for c in timed_kernels.companions(FLOAT32) if c.name == LIBM)
    llvm, asm = jit.code(libm.kernel.loop)
    assert "pow" in llvm + asm


@x86_only
def test_the_squarings_of_lyon_are_three_products_for_each_vector() -> None:
    asm = assembly("lyon", "dot", "soa", EIGHT)[1]
    loops = re.findall(r"(\.LBB\w+):\n((?:\t[^\n]*\n)*?)\tj\w+\t\1\n", asm)
    body = max((text for _, text in loops), key=lambda text: len(re.findall("[yz]mm", text)))
    stores = len(re.findall(r"vmovu?a?ps\s+%[yz]mm\d+, [^%\n]*\(", body))
    squares = len(re.findall(r"vmulps\s+(%[yz]mm\d+), \1, ", body))
    assert stores >= 1
    assert squares == 3 * stores
