"""Polynomials that stand for functions in compiled code, where a call of libm would defeat the vectoriser.

No coefficient is typed in: they are interpolated at Chebyshev nodes, or summed as series, when this module is imported.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.polynomial import chebyshev, polynomial


def through_chebyshev_nodes(function: Callable[[Any], Any], low: float, high: float, degree: int) -> tuple[float, ...]:
    """Coefficients, lowest first, of the polynomial through `function` at the Chebyshev nodes of [low, high]."""
    middle, half = (low + high) / 2, (high - low) / 2
    fitted = chebyshev.cheb2poly(chebyshev.chebinterpolate(lambda t: function(middle + half * t), degree))
    powers = [polynomial.polypow((-middle / half, 1 / half), k) for k in range(degree + 1)]
    total = np.zeros(degree + 1)
    for c, p in zip(fitted, powers, strict=True):
        total[: len(p)] += c * p
    return tuple(float(c) for c in total)


def _log2_ratio(f: Any) -> Any:
    """log2(1 + f) / f, whose value at 0 is 1 / ln 2."""
    f = np.asarray(f, dtype=float)
    safe = np.where(f == 0, 1.0, f)
    return np.where(f == 0, 1 / np.log(2), np.log1p(safe) / np.log(2) / safe)


def _exp2_ratio(r: Any) -> Any:
    """(2^r - 1) / r, whose value at 0 is ln 2."""
    r = np.asarray(r, dtype=float)
    safe = np.where(r == 0, 1.0, r)
    return np.where(r == 0, np.log(2), np.expm1(safe * np.log(2)) / safe)


#: the float32 polynomials are as short as an error of 3e-7 in a power allows: two terms more of the one and one of the
#: other give 8e-8 and cost a tenth of the power's time; 2^0 is 1 exactly
LOG2_RATIO = through_chebyshev_nodes(_log2_ratio, np.sqrt(0.5) - 1, np.sqrt(2) - 1, 7)
EXP2 = (1.0, *through_chebyshev_nodes(_exp2_ratio, -0.5, 0.5, 4))
#: 2 artanh(s) / ln 2 = s * sum of these times s^2k; exact rationals, enough of them for float64 where s <= 0.1716
ARTANH2: tuple[float, ...] = tuple(2 / np.log(2) / (2 * k + 1) for k in range(11))
#: 2^r = sum of these times r^k for |r| <= 1/2; the Taylor series to float64's last bit
EXP2_SERIES = tuple(float(np.log(2) ** k / np.prod(np.arange(1.0, k + 1))) for k in range(14))


def _arc_ratio(t: Any) -> Any:
    """acos(1 - d) / sqrt(d) for d = (t + 1) / 2, whose value at d = 0 is sqrt 2; free of acos's vertical tangent."""
    d = np.maximum((np.asarray(t, dtype=float) + 1) / 2, 1e-300)
    return 2 * np.arcsin(np.sqrt(d / 2)) / np.sqrt(d)


ARC_32 = through_chebyshev_nodes(_arc_ratio, -1, 1, 8)
ARC_64 = through_chebyshev_nodes(_arc_ratio, -1, 1, 18)
