"""Closed-form laws of the approximation error: what a measurement must agree with.

Words: lambda is 1 - cos of the angle between two unit directions, u = alpha * lambda the highlight coordinate,
gamma = 2**n the exponent an approximation is evaluated with, beta its slope. An error is signed, exact - approximation;
the law gives its extreme over lambda in [0, 1]: positive where the approximation is too dark. Every function takes
floats or arrays (they broadcast) and returns a float64 array of the broadcast shape, or a float for floats.

Each law states where it holds and how closely; tests/phongbench/formulas/test_error_laws.py holds it to that on a
dense float64 grid. They are model laws: formulas in exact arithmetic. float32 rounding adds at most about
alpha * 2**-25.

Source  all follow from Lyon's form, Apple Technical Report 43 (1993), by expansion in 1/gamma and 1/alpha; the numeric
        constants are fits to the dense grid of the tests.
"""

import math

import numpy as np
import numpy.typing as npt

Numbers = float | npt.NDArray[np.float64]

#: kappa of the leading law: how much faster than `dot` a form of lambda saturates.
KAPPA = {"dot": 1.0, "difference": 1.0, "cross": 2.0, "half": 0.75, "tan2": -2.0}


def E(t: Numbers) -> Numbers:  # noqa: N802 - the letter of the notes and of the report
    """Distance sup |exp(-u) - (1 - t u)^(1/t)| of a power from its exponential limit.

    t        float in (0, 1/2]   1 / exponent
    returns  float >= 0          0.2707 t + 0.100 t^2; the slope is 2 exp(-2), reached near u = 2

    Tolerance  0.3 % for t <= 1/8, 0.2 % at 1/4, 1 % at 1/2.
    """
    return 0.2707 * t + 0.100 * t * t


def lyon_taylor_dot(alpha: Numbers, gamma: Numbers) -> Numbers:
    """Law 1: largest error of Lyon's formula at beta = alpha / gamma; `dot` form, unit vectors.

    alpha    float >= 5      exact exponent
    gamma    float >= 2      exponent of the approximation
    returns  signed float    E(1/gamma) - E(1/alpha): > 0 (too dark) for gamma < alpha, 0 at gamma = alpha, < 0 beyond

    Tolerance  1 % for gamma >= 4 and 4 % at gamma = 2, of the error itself.
    Domain     `difference` obeys it too: on unit vectors both forms are the same number.
    """
    return E(1.0 / gamma) - E(1.0 / alpha)


def lyon_taylor_cross(alpha: Numbers, gamma: Numbers) -> Numbers:
    """Law 2: largest error of Lyon's formula at beta = alpha / gamma; `cross` form, unit vectors, a.b > 0.

    alpha    float >= 10     exact exponent
    gamma    float >= 2      exponent of the approximation
    returns  signed float    law 1 at alpha / 2; 0 where gamma = alpha / 2, because there it IS Phong

    |a x b|^2 / 2 = lambda - lambda^2/2, so 1 - beta lambda_cross is a cosine squared in disguise. The equality with the
    `dot` error at alpha / 2 is exact; the tolerance is law 1's.
    """
    return lyon_taylor_dot(0.5 * alpha, gamma)


def leading(alpha: Numbers, gamma: Numbers, kappa: Numbers) -> Numbers:
    """Law 3: one leading term for every form of lambda.

    alpha, gamma  float      exponents
    kappa         float      1 dot and difference, 2 cross, 3/4 half space at 4 alpha, -2 tan2; see KAPPA
    returns       signed     0.2707 (1/gamma - kappa/alpha)

    Tolerance  first order: off by up to 0.1 |1/gamma^2 - (kappa/alpha)^2| + 2 kappa^2/alpha^2; 10 % for gamma >= 4
               and alpha >= 16 away from its zero.
    """
    return 0.2707 * (1.0 / gamma - kappa / alpha)


def lyon_taylor(lambda_form: str, alpha: Numbers, gamma: Numbers) -> Numbers:
    """The sharpest law of a named lambda form (laws 1 to 3), signed; KeyError for a form without one."""
    if lambda_form == "cross":
        return lyon_taylor_cross(alpha, gamma)
    if lambda_form in ("dot", "difference"):
        return lyon_taylor_dot(alpha, gamma)
    return leading(alpha, gamma, KAPPA[lambda_form])


def gaussian_classic(alpha: Numbers) -> Numbers:
    """Law 7: largest error of exp(-alpha lambda), the c = 0 spherical Gaussian; `dot` form, unit vectors.

    alpha    float >= 5     exact exponent
    returns  signed float   -E(1/alpha): always too bright

    Law 1 with gamma -> infinity (law 4: more squarings lead here, not to Phong). Tolerance 1 %.
    """
    return -E(1.0 / alpha)


def minimax_offset(exponent: Numbers) -> Numbers:
    """Law 5: c(n) of the slope with the smallest largest error, (alpha + c(alpha)) / (gamma + c(gamma)); `dot` form.

    exponent  float >= 2   n: alpha >= 10, or gamma
    returns   float        0.6626 + 0.268/n

    Tolerance  of the slope against the numeric optimum: 1e-4 for gamma >= 8, 1e-3 at 4, 6e-3 at 2.
    """
    return 0.6626 + 0.268 / exponent


def dot_peak(alpha: Numbers, gamma: Numbers, e: Numbers, d: Numbers) -> Numbers:
    """Law 8: value at a = b of Lyon's formula at beta = alpha / gamma, `dot` form, for vectors of wrong length.

    alpha, gamma  float > 0     exponents, exact and of the approximation
    e, d          float > -1    relative length errors, signed: the vectors are 1 + e and 1 + d long
    returns       float >= 0    max(0, 1 + beta (s - 1))^gamma, s = (1 + e)(1 + d); exact

    Above 1 as soon as s > 1, like exp(alpha (s - 1)): (128, 64) with one vector 1 % long peaks at 3.55.
    """
    excess = (1.0 + e) * (1.0 + d) - 1.0
    return np.maximum(0.0, 1.0 + alpha / gamma * excess) ** gamma


def dot_length_change(alpha: Numbers, e: Numbers, d: Numbers) -> Numbers:
    """Law 8: largest change of the highlight by lengths, `dot` form: |expm1(alpha (s - 1))| at the peak.

    alpha    float > 0     exact exponent
    e, d     float > -1    relative length errors, signed; s = (1 + e)(1 + d)
    returns  float >= 0    absolute change of the highlight

    Its first order is alpha |e + d|. Tolerance 5 % for alpha |s - 1| <= 0.1 and gamma >= 8; `dot_peak` is exact.
    """
    excess = (1.0 + e) * (1.0 + d) - 1.0
    return np.abs(np.expm1(alpha * excess))


def difference_length_change(alpha: Numbers, e: Numbers, d: Numbers) -> Numbers:
    """Law 8: largest change of the highlight by lengths, `difference` form, absolute. Arguments as `dot_length_change`.

    lambda' = s lambda + (e - d)^2/2 changes u by r u + q with r = s - 1, q = alpha (e - d)^2/2, and the value by
    exp(-u) (r u + q): q at the peak, |r| exp(-1 +- q/|r|) on the flank near u = 1.
    Tolerance 6 % for gamma >= 16, alpha |e| <= 2, |e| <= 0.01: (128, 64) with one vector 1 % long changes by .0070.
    """
    stretch = (1.0 + e) * (1.0 + d) - 1.0
    offset = 0.5 * alpha * (np.asarray(e) - d) ** 2
    magnitude = np.maximum(np.abs(stretch), 1e-300)
    where = np.maximum(0.0, 1.0 - offset / np.where(stretch < 0.0, -magnitude, magnitude))
    flank = np.abs(np.exp(-where) * (stretch * where + offset))
    return np.maximum(offset, flank)


def cross_length_change(alpha: Numbers, e: Numbers, d: Numbers) -> Numbers:
    """Law 8: largest change of the highlight by lengths, `cross` form: |s^2 - 1| / e near u = 1, absolute.

    Arguments as for `dot_length_change`; e in the formula is Euler's number.
    Nothing at the peak, twice the slope error of `difference` on the flank. alpha only broadcasts: the change does not
    depend on it. Tolerance 6 % for gamma >= 16 and |e| <= 0.01: (128, 64) with one vector 1 % long changes by .0074.
    """
    scale = ((1.0 + e) * (1.0 + d)) ** 2
    return np.abs(scale - 1.0) / math.e + 0.0 * alpha


def length_crossover(alpha: Numbers) -> Numbers:
    """Length error of one vector, 2 ln 2/alpha = 1.39/alpha, up to which `difference` changes less than `cross`.

    Where exp(-1 + alpha e/2) = 2/e, both to first order. Equal errors on both vectors: `difference` is always better;
    opposite errors: `cross` always is, since s stays 1.
    """
    return 2.0 * math.log(2.0) / alpha
