"""How far rounding moves a highlight: a law for every working precision, beside the model laws of `error_laws`."""

import math

from phongbench.compiler.precisions import precision_named


def rounding_bound(gamma: int | None, alpha: float, precision: str, space: str = "reflect") -> float:
    """How far rounding may move a highlight's value, at most, on vectors normalised as v * (1 / sqrt(v.v)).

    In units of eps, the step from 1 to the next number: each vector's length errs by up to 2.25, the dot product by 1.5
    and what is subtracted from it by 0.5, which a slope of at most alpha turns into 6.5 alpha; an exact power by
    squaring adds 0.5 alpha. Lyon's chain adds 2 gamma: the quotient and the difference from 1 half a step each and its
    coefficient another, all to the power gamma, and gamma / 2 by its own squarings. Exponentials and logarithms add 8.
    With fused multiply-adds fewer operations round. In half space the slope is 4 alpha.
    """
    eps = precision_named(precision).eps
    slope = alpha * (4 if space == "half" else 1)
    return math.expm1(min(8 * slope * eps, 30.0)) + (2 * (gamma or 1) + 8) * eps  # beyond any use, but finite
