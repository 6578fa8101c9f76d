"""Scalar helpers on 3-vectors given by their components: the cosine and the lambda forms.

Each body is plain Python and lowered to every working precision by lowering.py, so a lambda form is written once. The
same body on mpmath numbers is the exact value that the compiled ones are tested against.
"""


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
