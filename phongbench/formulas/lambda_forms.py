"""Scalar helpers on 3-vectors given by their components: the cosine and the lambda forms.

Each body is plain Python and lowered to every working precision by lowering.py, so a lambda form is written once. The
same body on mpmath numbers is the exact value that the compiled ones are tested against.
"""

import math
from typing import Any

import numpy as np


def dot(ax: float, ay: float, az: float, bx: float, by: float, bz: float) -> float:
    """a.b: the cosine of the angle between a and b when both are unit vectors; finite for finite input."""
    return ax * bx + ay * by + az * bz


def dot_deficit(ax: float, ay: float, az: float, bx: float, by: float, bz: float) -> float:
    """Lambda form `dot`: 1 - a.b.

    Returns 1 - cos(angle) for unit vectors; negative for over-long ones. Source LYON_1993.
    """
    return 1.0 - dot(ax, ay, az, bx, by, bz)


def half_squared_difference(ax: float, ay: float, az: float, bx: float, by: float, bz: float) -> float:
    """Lambda form `difference`: |a - b|^2 / 2.

    Equals 1 - a.b for unit vectors and keeps relative accuracy near the peak; never negative. Source LYON_1993.
    """
    dx = ax - bx
    dy = ay - by
    dz = az - bz
    return 0.5 * (dx * dx + dy * dy + dz * dz)


def squared_cross(ax: float, ay: float, az: float, bx: float, by: float, bz: float) -> float:
    """|a x b|^2: sin^2 of the angle between unit vectors; blind to the sign of a.b."""
    cx = ay * bz - az * by
    cy = az * bx - ax * bz
    cz = ax * by - ay * bx
    return cx * cx + cy * cy + cz * cz


def half_squared_cross(ax: float, ay: float, az: float, bx: float, by: float, bz: float) -> float:
    """Lambda form `cross`: |a x b|^2 / 2.

    Equals lambda - lambda^2 / 2 for unit vectors. It sees sin^2 only, so without a gate on a.b > 0 it is zero again,
    and the highlight shines fully, at a = -b. Source LYON_1993.
    """
    return 0.5 * squared_cross(ax, ay, az, bx, by, bz)


def half_squared_tangent(ax: float, ay: float, az: float, bx: float, by: float, bz: float) -> float:
    """Lambda form `tan2`: |a x b|^2 / (2 (a.b)^2).

    Free of both lengths. Infinite at 90 degrees; a zero vector gives NaN (0 / 0), which the peak test of a formula
    turns to 0. Costs one division. Derived here.
    """
    x = dot(ax, ay, az, bx, by, bz)
    return 0.5 * squared_cross(ax, ay, az, bx, by, bz) / (x * x)


#: lambda form -> its scalar body; the order is the row index of every compiled coordinate block
LAMBDA_FORMS = {
    "dot": dot_deficit,
    "difference": half_squared_difference,
    "cross": half_squared_cross,
    "tan2": half_squared_tangent,
}


def cutoff_deficit(form: str, value: float) -> float | None:
    """The deficit 1 - cos(angle) at which a lambda form of unit vectors reaches `value`; None if it never does."""
    if form == "cross":
        return 1 - math.sqrt(1 - 2 * value) if value <= 0.5 else None
    if form == "tan2":
        return 1 - 1 / math.sqrt(1 + 2 * value)
    return value if value <= 2 else None


def deficit_of_angle(form: str, cosine: Any) -> Any:
    """Lambda of unit vectors at this cosine, in exact arithmetic: what each form sees of an angle.

    cosine  an array, or any kind of number
    """
    if form in ("dot", "difference"):
        return 1 - cosine
    sine_squared = 1 - cosine * cosine
    if form == "cross":
        return sine_squared / 2
    with np.errstate(divide="ignore"):
        return sine_squared / (2 * (cosine * cosine))


def lengths_of(perturbation: str, length_error: float) -> tuple[float, float]:
    """|a| and |b| of vectors that should have length 1.

    perturbation  whose length is wrong: a, both, opposite (a too long, b too short); anything else: nobody's
    length_error  relative and signed; 0.01 is 1 % too long
    """
    of_a = length_error if perturbation in ("a", "both", "opposite") else 0.0
    of_b = {"both": length_error, "opposite": -length_error}.get(perturbation, 0.0)
    return 1 + of_a, 1 + of_b
