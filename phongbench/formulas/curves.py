"""The highlight against the angle, as a working precision holds it and as vectors of wrong length make it."""

import math

import numpy as np

from phongbench.compiler.precisions import FLOAT64, Array, Precision
from phongbench.formulas import coordinate_kernels
from phongbench.formulas.kernel import Kernel, evaluate
from phongbench.formulas.lambda_forms import cutoff_deficit, deficit_of_angle, lengths_of
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.spec import Approximation, Setting

#: the plane that pairs are laid out in: its first axis, where both directions agree, and its second; any plane askew to
#: the axes would do, in one of them most products are 0 or 1 and nothing is rounded
_ACROSS = np.array([2.0, 3.0, 6.0]) / 7.0
_ALONG = np.array([6.0, 2.0, -3.0]) / 7.0


def lobe(
    spec: Approximation,
    form: str,
    setting: Setting,
    degrees: Array,
    *,
    precision: Precision = FLOAT64,
    perturbation: str = "none",
    length_error: float = 0.0,
    normalise: str = "none",
) -> tuple[Array, Array]:
    """The highlight of real vectors at these angles between R and V, and exact Phong of the true angle between them.

    form          str                one of the approximation's lambda forms; none for kernels of the cosine
    degrees       (n,) in 0 .. 90    angles of (R, V); of (N, H), where the setting's space is half, half of each
    perturbation  str                none, a, both or opposite: whose length is wrong
    length_error  relative, signed   0.01 is 1 % too long
    normalise     str                how lengths are removed
    returns       value, exact       (n,) each, float64; the truth `angle`: of the vectors as the precision holds them

    The same loops as in a sweep, coordinate first and then the formula, open only where a.b > 0.
    Raises InputError for a setting that the approximation does not take.
    """
    spec.check(setting)
    half = setting.space == "half"
    turn = np.radians(np.asarray(degrees, dtype=np.float64) / (2 if half else 1))
    one, other = lengths_of(perturbation, length_error)
    a = _held(precision, one * (np.outer(_ACROSS, np.cos(turn)) + np.outer(_ALONG, np.sin(turn))))
    b = _held(precision, other * np.repeat(_ACROSS[:, None], turn.size, axis=1))
    return _values(spec, form, setting, a, b, precision, normalise), _exact(setting, a, b)


def against_exact(
    spec: Approximation,
    form: str,
    setting: Setting,
    degrees: Array,
    precision: Precision = FLOAT64,
    perturbation: str = "none",
    length_error: float = 0.0,
    *,
    normalise: str = "none",
) -> tuple[Array, Array]:
    """The highlight and exact Phong at these angles between R and V: (n,) each, float64; arguments as for `lobe`.

    In float64 with right lengths, none removed, the formula is evaluated at the angles themselves, else by vectors.
    """
    if precision is FLOAT64 and not length_error and normalise == "none":
        cosine = np.cos(np.radians(degrees))
        return curve(spec, form, setting, cosine), exact(setting.alpha, cosine)
    return lobe(
        spec,
        form,
        setting,
        degrees,
        precision=precision,
        perturbation=perturbation,
        length_error=length_error,
        normalise=normalise,
    )


def exact(alpha: float, cosine: Array) -> Array:
    """Exact Phong, max(0, cosine)^alpha, in float64 at these cosines between R and V; both of shape (n,)."""
    phong = REGISTRY["phong"]
    return curve(phong, phong.lambda_forms[0], Setting(alpha), cosine)


def cutoff_degrees(spec: Approximation, form: str, setting: Setting) -> float | None:
    """The angle between R and V, below 90 degrees, beyond which unit vectors give exactly 0; None if there is none."""
    value = None if spec.cutoff is None else spec.cutoff(setting)
    deficit = None if value is None else value if form == "none" else cutoff_deficit(form, value)
    if deficit is None or deficit >= 1:
        return None
    own = math.degrees(math.acos(1 - deficit))
    angle = 2 * own if setting.space == "half" else own
    return angle if angle < 90 else None


def _held(precision: Precision, vectors: Array) -> Array:
    return np.ascontiguousarray(precision.rounded(vectors))


def _values(
    spec: Approximation, form: str, setting: Setting, a: Array, b: Array, precision: Precision, normalise: str
) -> Array:
    """The formula's values by the loops of the sweep, in the working precision."""
    block = coordinate_kernels.coordinates(precision, a, b, normalise=normalise)
    row = coordinate_kernels.FORM_ROW.get(form, coordinate_kernels.COSINE_ROW)
    gate = coordinate_kernels.COSINE_ROW if normalise == "none" else coordinate_kernels.OPEN_ROW
    return Kernel.of(spec, setting, precision).values(block[row], block[gate]).astype(np.float64)


def _exact(setting: Setting, a: Array, b: Array) -> Array:
    """Phong of the angle between the vectors as they are held, whatever their lengths; of (N, H), of twice it."""
    a, b = a.astype(np.float64), b.astype(np.float64)
    angle = np.arctan2(np.linalg.norm(np.cross(a, b, axis=0), axis=0), np.einsum("ij,ij->j", a, b))
    return exact(setting.alpha, np.cos(2 * angle if setting.space == "half" else angle))


def curve(spec: Approximation, form: str, setting: Setting, cosine: Array) -> Array:
    """The highlight in float64 at these cosines between (R, V): what a plot against the angle shows.

    form     one of the approximation's lambda forms
    cosine   (n,) in [-1, 1]
    returns  (n,) float64

    In half space the coplanar (N, H) of the same configuration is used: its angle is half of that between R and V.
    """
    cosine = np.asarray(cosine, dtype=np.float64)
    own = np.sqrt((1 + cosine) / 2) if setting.space == "half" else cosine
    return evaluate(spec, setting, own if form == "none" else deficit_of_angle(form, own), own)
