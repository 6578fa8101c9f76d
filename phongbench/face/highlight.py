"""The formulas on NumPy arrays, over the angle, and as shader code; each is named by its spelling."""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
import pandas as pd
from numpy.lib.stride_tricks import as_strided
from numpy.typing import ArrayLike

from phongbench.analysis.ready_code import ready_code
from phongbench.compiler.precisions import FLOAT32, FLOAT64, Array, Precision, precision_named
from phongbench.errors import InputError
from phongbench.formulas import curves, lobe_moments
from phongbench.formulas.formula import Formula, Registry
from phongbench.formulas.kernel import Kernel
from phongbench.formulas.recipes import PAIR
from phongbench.formulas.registry import guarded
from phongbench.formulas.shader_code.export import Options
from phongbench.formulas.spec import Approximation
from phongbench.formulas.user_files import extended, installed
from phongbench.support.values import number

#: the fewest pairs that a thread takes at a time, and how often a single vector is repeated
BLOCK = 1 << 15


def specular(
    a: ArrayLike,
    b: ArrayLike,
    formula: str | Formula = "phong",
    *,
    alpha: float,
    out: Array | None = None,
    threads: int = 1,
    own: Sequence[Approximation] = (),
) -> Array:
    """The highlight of pairs of directions: `formula` in place of max(0, a.b)^alpha, 0 where a.b is not positive.

    a, b     (N, 3), (3, N) or one vector (3,)  the pair (R, V), or (N, H) for formulas of it. (3, 3) is read as (N, 3);
                                                one vector is paired with every other. float32 and float64 are computed
                                                as they are, a mixture or other numbers in the one that holds them.
                                                C-contiguous arrays, read-only ones too, are not copied
    formula  NAME[:FORM][:GAMMA][:SLOPE][@RECIPE], e.g. "lyon:dot:32:minimax"
    alpha    float > 0                          the exponent that the formula stands for
    out      (N,) of the computed type          where to write; it must not overlap a or b
    threads  int >= 1                           the values are the same for every number
    own      further approximations that `formula` may name, as `load_file` gives them
    returns  (N,), `out` where it is given; of two single vectors an array without dimensions
    Raises InputError, or UnknownNameError for names, saying what was expected.

    >>> pb.specular([[0, 0, 1], [0, 0.6, 0.8]], [0, 0, 1], "lyon:dot:8", alpha=10)
    array([1.        , 0.10011292])
    """
    one, other = _vectors("a", a), _vectors("b", b)
    count = len(other) if len(one) == 1 else len(one)
    if len(other) not in (1, count):
        raise InputError(f"{len(one)} vectors in a and {len(other)} in b", "b", "give as many, or a single vector")
    if threads < 1:
        raise InputError(f"{threads} threads", "threads", "give 1 or more")
    precision = computed_in(one, other)
    by_rows = all(v.T.flags.c_contiguous for v in (one, other) if len(v) > 1)
    pair = [_repeated(np.require(v.T if by_rows else v, precision.carrier, ("C", "A")), count) for v in (one, other)]
    values = (
        np.empty(count, precision.carrier) if out is None else _checked(out, count, precision.carrier, (one, other))
    )
    kernel = _kernel(formula, number(alpha, "alpha"), precision, "soa" if by_rows else "aos", tuple(own))
    _fill(kernel, pair, values, threads, by_rows)
    return values.reshape(()) if out is None and np.ndim(a) == np.ndim(b) == 1 else values


def curve(
    formula: str | Formula = "phong",
    *,
    alpha: float,
    degrees: ArrayLike | None = None,
    precision: str = "float64",
    own: Sequence[Approximation] = (),
) -> pd.DataFrame:
    """The highlight against the angle between R and V, beside exact Phong.

    degrees    (n,) in 0 .. 90   [default: 361 from 0 to 90]
    precision  a name such as "float16": the vectors and every operation are rounded to it
    returns    columns angle_degrees, value, exact, error = value - exact
    The other arguments are those of `specular`.

    >>> float(pb.curve("lyon:dot:8", alpha=10)["error"].abs().max().round(4))
    0.0073
    """
    chosen, registry = formula_of(formula, own)
    alpha = number(alpha, "alpha")
    chosen.check(alpha, registry)
    chosen.check_pair("formula")
    angle = np.linspace(0, 90, 361) if degrees is None else np.asarray(degrees, dtype=np.float64)
    if angle.ndim != 1:
        raise InputError(f"degrees of shape {angle.shape}", "degrees", "give angles in one dimension")
    value, exact = curves.against_exact(
        chosen.spec(registry),
        chosen.lambda_form,
        chosen.setting(alpha),
        angle,
        precision_named(precision),
        normalise=chosen.normalise,
    )
    return pd.DataFrame({"angle_degrees": angle, "value": value, "exact": exact, "error": value - exact})


def moments(
    formula: str | Formula = "phong", *, alpha: float, incidence: ArrayLike = 0.0, own: Sequence[Approximation] = ()
) -> pd.DataFrame:
    """What the formula's lobe sends where, for light of intensity 1 along its peak, beside exact Phong.

    incidence  degrees, 0 .. 90   one angle between light and normal, or several
    returns    a row for each: incidence_degrees; energy, the lobe's integral over directions above the horizon, in
               steradians; momentum and sideways, its parts along the mirrored direction, and across that towards the
               normal; half_width_degrees; and the ratios of energy, momentum and half width to those of exact Phong
    The other arguments are those of `specular`.

    >>> pb.moments("lyon:dot:8", alpha=50)[["energy_ratio", "momentum_ratio", "half_width_ratio"]].round(3)
       energy_ratio  momentum_ratio  half_width_ratio
    0         0.907            0.91             0.982
    """
    chosen, registry = formula_of(formula, own)
    alpha = number(alpha, "alpha")
    chosen = replace(chosen, recipe=PAIR, normalise="none")  # on unit vectors these change nothing
    chosen.check(alpha, registry)
    angles = tuple(np.atleast_1d(numbers("incidence", incidence)).astype(float).ravel().tolist())
    spec = chosen.spec(registry)
    with guarded(spec):
        found = lobe_moments.moments(spec, chosen.lambda_form, chosen.setting(alpha), angles)
    return pd.DataFrame({"incidence_degrees": angles} | lobe_moments.beside_exact(found, alpha, angles))


def shader(
    formula: str | Formula,
    *,
    alpha: float,
    language: str = "glsl",
    precision: str = "float32",
    over_long: str = "clamp",
    length_error: float = 0.0,
    target: str | Sequence[str] = (),
    own: Sequence[Approximation] = (),
) -> str:
    """The formula as source text: a function `highlight` of two directions, or of n, l and v, its constants filled in.

    language      glsl, hlsl, wgsl, metal, c, essl100, essl300, cuda or numpy
    precision     float32; float16 or mediump where the language has it. The error told at the top is measured in it
    over_long     clamp, or keep: whether vectors longer than 1 give no more than 1 on GPUs, or what the formula says
    length_error  how wrong the directions' lengths may be, for the error told: 0.01 is up to 1 %
    target        name of a compiled target, or several, whose costs are told too, e.g. "rdna2"
    The other arguments are those of `specular`. Raises InputError for what a language or a target does not have.

    >>> print(pb.shader("blinn", alpha=50).splitlines()[-1])
    }
    """
    chosen, registry = formula_of(formula, own)
    targets = (target,) if isinstance(target, str) else tuple(target)
    options = Options(language, precision, over_long, number(length_error, "length_error"), targets)
    return ready_code(chosen, number(alpha, "alpha"), options, registry).text


def formula_of(formula: str | Formula, own: Sequence[Approximation]) -> tuple[Formula, Registry]:
    """The formula of a spelling, and the registry that holds it: ours, the plug-ins' and the caller's own."""
    registry = extended(own, installed()) if own else installed()
    if not isinstance(formula, str | Formula):
        raise InputError(f"{type(formula).__name__} instead of a spelling", "formula", 'write e.g. "lyon:dot:8"')
    return formula if isinstance(formula, Formula) else Formula.parse(formula, registry), registry


@lru_cache(maxsize=256)
def _kernel(
    formula: str | Formula, alpha: float, precision: Precision, layout: str, own: tuple[Approximation, ...]
) -> Kernel:
    chosen, registry = formula_of(formula, own)
    spec = chosen.spec(registry)
    chosen.check_pair("formula")
    with guarded(spec):
        chosen.check(alpha, registry)
        setting = chosen.setting(alpha)
        return Kernel.of_pairs(spec, chosen.lambda_form, setting, precision, layout, normalise=chosen.normalise)


def numbers(name: str, given: ArrayLike) -> Array:
    """An array of real numbers; InputError for anything else."""
    array = np.asarray(given)
    if array.dtype.kind not in "fiu" or array.dtype.itemsize > FLOAT64.carrier.itemsize:
        raise InputError(f"{name} holds {array.dtype}", name, "give float32 or float64, or what converts to them")
    return array


def computed_in(*arrays: Array) -> Precision:
    """The precision that holds what all of these hold: float32, or float64."""
    common = np.result_type(np.float16, *arrays)
    return FLOAT32 if common.itemsize <= FLOAT32.carrier.itemsize else FLOAT64


def _vectors(name: str, given: ArrayLike) -> Array:
    """The vectors as a view of shape (N, 3)."""
    array = numbers(name, given)
    if array.shape == (3,):
        return array[None]
    if array.ndim == 2 and 3 in array.shape:
        return array if array.shape[1] == 3 else array.T
    raise InputError(f"{name} of shape {array.shape}", name, "give (N, 3), (3, N) or one vector (3,)")


def _repeated(vectors: Array, count: int) -> Array:
    """A single vector as a block of equal ones, where it is paired with several; others as they are.

    vectors  (n, 3) or (3, n)
    """
    if vectors.size != 3 or count == 1:
        return vectors
    shape = (min(count, BLOCK), 3) if vectors.shape[1] == 3 else (3, min(count, BLOCK))
    return np.ascontiguousarray(np.broadcast_to(vectors, shape))


def _checked(out: Any, count: int, dtype: np.dtype[Any], inputs: Sequence[Array]) -> Array:
    wanted = f"a C-contiguous, writable array of {dtype} of shape ({count},)"
    if not isinstance(out, np.ndarray) or out.shape != (count,) or out.dtype != dtype:
        shown = f"{out.dtype} of shape {out.shape}" if isinstance(out, np.ndarray) else type(out).__name__
        raise InputError(shown, "out", f"give {wanted}")
    if not (out.flags.c_contiguous and out.flags.writeable and out.flags.aligned):
        raise InputError("read-only, strided or unaligned", "out", f"give {wanted}")
    if any(np.may_share_memory(out, given) for given in inputs):
        raise InputError("shares memory with a or b", "out", f"give {wanted} of its own")
    return out


def _fill(kernel: Kernel, pair: Sequence[Array], out: Array, threads: int, by_rows: bool) -> None:
    """Run the kernel in parts: one for each thread, or as long as a single vector's block."""
    count = len(out)
    axis = 1 if by_rows else 0
    blocks = [v.shape[axis] < count for v in pair]
    step = BLOCK if any(blocks) else max(BLOCK, -(-count // threads))

    def part(start: int) -> None:
        views = [v if block else _from(v, start, by_rows) for v, block in zip(pair, blocks, strict=True)]
        kernel.fill_pairs(views[0], views[1], out[start : start + step])

    starts = range(0, count, step)
    if threads == 1 or len(starts) < 2:
        for start in starts:
            part(start)
        return
    with ThreadPoolExecutor(min(threads, len(starts))) as pool:
        list(pool.map(part, starts))


def _from(vectors: Array, start: int, by_rows: bool) -> Array:
    """The vectors from this one on. The loops read as many as `out` is long, so of rows the distance must stay: the
    view is as wide as the whole, and nothing beyond the last row's end is read.
    """
    if start == 0:
        return vectors
    return as_strided(vectors[:, start:], vectors.shape, vectors.strides) if by_rows else vectors[start:]
