"""Coefficients that no closed form gives: small minimax searches, run once for a setting and remembered."""

from functools import cache
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@cache
def parabola(exponent: float, gamma: int) -> tuple[float, float]:
    """The (beta, curvature) with the least largest error against (1 - lambda)^exponent on 0 <= lambda <= 1.

    Gauss-Newton for the maximum norm: the error is linearised in both coefficients at its local extremes, and the
    linear problem is solved exactly by trying every three of them as the ones that alternate (de la Vallee Poussin).
    Two starts, the better result: the Taylor coefficients, and a curvature whose floor (1 - 1 / (4 curvature))^gamma is
    low enough.
    """
    taylor, low = 0.5 * (1.0 - gamma / exponent), 0.25 / (1.0 - 0.02 ** (1.0 / gamma))
    starts = [np.array([exponent / gamma, max(-2.0, start)]) for start in (taylor, min(taylor, low))]
    fits = [_descend(exponent, gamma, start) for start in starts]
    _, (beta, curvature) = min(fits, key=lambda fit: fit[0])
    return float(beta), float(curvature)


def _descend(exponent: float, gamma: int, at: Array) -> tuple[float, Array]:
    """The largest error that is reached from a start, and where."""
    deficit = np.linspace(0.0, min(1.0, 18.0 / exponent), 600)
    exact, reached = (1.0 - deficit) ** exponent, np.inf
    e = exact - _approximate(deficit, at)[1] ** gamma
    for _ in range(40):
        if not np.abs(e).max() < (1 - 1e-7) * reached:
            break
        reached = np.abs(e).max()
        step = _best_step(e, _jacobian(deficit, gamma, at))
        for k in range(16):
            tried = at + step / 2**k
            error = exact - _approximate(deficit, tried)[1] ** gamma
            if np.abs(error).max() < reached:
                at, e = tried, error
                break
    return float(np.abs(e).max()), at


def _approximate(deficit: Array, at: Array) -> tuple[Array, Array]:
    """v up to the turn, and 1 - v + curvature v^2, both at these deficits, for (beta, curvature)."""
    beta, curvature = at
    v = np.minimum(beta * deficit, turn(curvature))
    return v, np.maximum(1.0 - v * (1.0 - curvature * v), 0.0)


def _jacobian(deficit: Array, gamma: int, at: Array) -> Array:
    """The derivatives of the approximation by beta and curvature: (n, 2)."""
    curvature, (v, base) = at[1], _approximate(deficit, at)
    outer = gamma * base ** (gamma - 1) * (base > 0)
    slope = np.where(v < turn(curvature), deficit * (2.0 * curvature * v - 1.0), 0.0)
    return np.stack([outer * slope, outer * v * v], axis=1)


def _best_step(e: Array, jacobian: Array) -> Array:
    """The change of both coefficients that minimises the largest |e - jacobian change| over the extremes of e."""
    size = np.abs(e)
    peaks = np.flatnonzero((size[1:-1] >= size[:-2]) & (size[1:-1] >= size[2:])) + 1
    peaks = np.concatenate([peaks[np.argsort(size[peaks])[-6:]], [1, len(e) // 2, len(e) - 1]])
    triples = np.array(list(combinations(peaks, 3)))
    weights = np.cross(jacobian[triples, 0], jacobian[triples, 1])  # what no change of the coefficients can reduce
    total = np.abs(weights).sum(axis=1)
    level = (weights * e[triples]).sum(axis=1) / np.where(total > 0, total, np.inf)
    worst = int(np.argmax(np.abs(level)))
    target = e[triples[worst]] - level[worst] * np.sign(weights[worst])
    return np.asarray(np.linalg.lstsq(jacobian[triples[worst]], target, rcond=None)[0])


def turn(curvature: float) -> float:
    """Where the parabola 1 - v + curvature v^2 is lowest, or a v up to 2 at which it is not positive any more."""
    return 0.5 / max(curvature, 0.25)


@cache
def half_angle_ratio(exponent: float) -> float:
    """The r with the least largest |cos(t)^exponent - cos(t/2)^(r exponent)|, 0 <= t <= 90 degrees; golden section."""
    cosine = 1.0 - np.linspace(0.0, min(1.0, 18.0 / exponent), 1001)
    exact, logarithm = cosine**exponent, exponent * np.log(np.sqrt((1.0 + cosine) / 2.0))
    low, high, golden = 3.9, 12.0, (5.0**0.5 - 1.0) / 2.0

    def worst(ratio: float) -> float:
        return float(np.abs(exact - np.exp(ratio * logarithm)).max())

    while high - low > 1e-6:
        a, b = high - golden * (high - low), low + golden * (high - low)
        low, high = (low, b) if worst(a) < worst(b) else (a, high)
    return (low + high) / 2.0
