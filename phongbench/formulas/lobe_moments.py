"""What a lobe sends where: its light above the horizon, and the momentum of that light, at any angle of incidence.

A lobe is the formula's highlight as a function of the direction V in which light leaves, for light that arrives in one
direction L: around the mirrored direction R for formulas of (R, V), around the normal N for those of H, half way
between L and V. Light sent below the horizon is none, so the lobe is cut off there, and its mean direction turns
towards the normal.

Formula  with t the angle between R and V, and f the highlight: energy = integral of f dV, momentum = integral of f V dV
         over V.N > 0. The integral over the circle around R, or around N for H, is done by hand, that over t by
         Gauss-Legendre quadrature on panels that end where f or the horizon bends.
Source   derived here; the closed forms of `lobe_laws`, and integrals over both angles, are the oracles of the tests
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache, lru_cache

import numpy as np

from phongbench.compiler.precisions import Array
from phongbench.errors import InputError
from phongbench.formulas import curves
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.spec import Approximation, Setting

#: ends of panels in widths of a lobe, 1 / sqrt(alpha): fine in the lobe, coarse in its tail
_PANELS = np.concatenate([[0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0], 8.0 * 2.0 ** np.arange(8)])
#: nodes of a panel
_NODES = 16
#: how far the even part of the angles reaches among which the half width is looked for, in widths; points of each part
_EVEN, _POINTS = 4.0, 1024


@dataclass(frozen=True)
class Moments:
    """Integrals of a lobe over the directions above the horizon, one for each angle of incidence, in steradians.

    energy      (n,)   light sent off, for 1 along the peak
    momentum    (n,)   its part along the mirrored direction R
    sideways    (n,)   its part across R in the plane of incidence, towards the normal
    half_width  float  angle between R and V in degrees, coplanar with N, where the highlight is half of its peak;
                       NaN if it never falls so far, up to a.b = 0
    """

    energy: Array
    momentum: Array
    sideways: Array
    half_width: float


def moments(spec: Approximation, form: str, setting: Setting, incidence: Iterable[float]) -> Moments:
    """The integrals of a formula's lobe; within 1e-5 of their value, and 1e-10 for lobes without corners.

    form       str                one of the approximation's lambda forms; none for kernels of the cosine
    incidence  degrees, 0 .. 90   of the light, from the normal
    Raises InputError for a setting that the approximation does not take, and for angles out of range.
    """
    angles = tuple(float(angle) for angle in incidence)
    for angle in angles:
        if not 0 <= angle <= 90:
            raise InputError(f"incidence = {angle:g} is outside 0 .. 90", "incidence", "give degrees from the normal")
    spec.check(setting)
    # the end of a squared or steeper foot is smooth enough for every panel
    end = None if setting.gamma and setting.gamma > 2 else curves.cutoff_degrees(spec, form, setting)
    grid = _grid(setting.space, setting.alpha, angles, end)
    values = curves.curve(spec, form, setting, grid.cosine)
    split = len(grid.angle)
    with np.errstate(all="ignore"):  # a user's own lobe may be infinite somewhere; so are its integrals then
        energy, momentum, sideways = (grid.weights @ values[split:]).reshape(3, len(angles))
    return Moments(energy, momentum, sideways, math.degrees(_half_width(grid.angle, values[:split])))


@lru_cache(maxsize=1024)
def exact(alpha: float, incidence: tuple[float, ...]) -> Moments:
    """The integrals of Phong's own lobe."""
    return moments(REGISTRY["phong"], "none", Setting(alpha), incidence)


def beside_exact(found: Moments, alpha: float, incidence: tuple[float, ...]) -> dict[str, Array]:
    """Columns of a lobe's moments, one entry for each incidence, and their ratios to those of exact Phong."""
    truth, same = exact(alpha, incidence), np.ones(len(incidence))
    return {
        "energy": found.energy,
        "energy_ratio": found.energy / truth.energy,
        "momentum": found.momentum,
        "momentum_ratio": found.momentum / truth.momentum,
        "sideways": found.sideways,
        "half_width_degrees": found.half_width * same,
        "half_width_ratio": found.half_width / truth.half_width * same,
    }


@dataclass(frozen=True)
class _Grid:
    """Where a lobe is looked at, the angles of the half width first, and the weights of the others.

    angle    (m,)             between R and V, ascending from 0, in radians
    cosine   (m + n,)         of these, and of the nodes of all incidences
    weights  (3 * k, n)       of energy, momentum and sideways at k incidences
    """

    angle: Array
    cosine: Array
    weights: Array


@lru_cache(maxsize=256)
def _grid(space: str, alpha: float, incidence: tuple[float, ...], cutoff_degrees: float | None) -> _Grid:
    end = math.pi if space == "half" else math.pi / 2
    width = min(end, 1 / math.sqrt(alpha)) if alpha else end
    near = min(end, _EVEN * width)
    angle = np.concatenate([np.linspace(0.0, near, _POINTS), np.geomspace(near, end, _POINTS)[1:]])
    bends = () if cutoff_degrees is None else (math.radians(cutoff_degrees),)
    nodes = [_nodes(space, width, math.radians(degrees), bends) for degrees in incidence]
    total = sum(len(t) for t, _ in nodes)
    weights, start = np.zeros((3, len(nodes), total)), 0
    for k, (t, mine) in enumerate(nodes):
        weights[:, k, start : start + len(t)] = mine
        start += len(t)
    cosine = np.cos(np.concatenate([angle, *(t for t, _ in nodes)]))
    return _Grid(angle, cosine, weights.reshape(3 * len(nodes), total))


def _half_width(angle: Array, values: Array) -> float:
    """The angle where the value is half of the first one, by a straight line between two; NaN if there is none."""
    half = values[0] / 2
    dark = np.flatnonzero(values <= half)
    if not len(dark) or dark[0] == 0:
        return math.nan
    after = int(dark[0])
    share = (values[after - 1] - half) / (values[after - 1] - values[after])
    return float(angle[after - 1] + share * (angle[after] - angle[after - 1]))


def _nodes(space: str, width: float, theta: float, bends: tuple[float, ...]) -> tuple[Array, Array]:
    """Angles between R and V, and their weights in energy, momentum and sideways: (n,) and (3, n)."""
    end = math.pi if space == "half" else math.pi / 2
    ends = (*(width * _PANELS), math.pi / 2 - theta, math.pi / 2 + theta, *bends)
    edges = np.unique([0.0, end, *(edge for edge in ends if 0 < edge < end)])
    t, length = _quadrature(edges)
    weights = _half(theta, t / 2) / 2 if space == "half" else _reflect(theta, t)
    return t, weights * length


def _quadrature(edges: Array) -> tuple[Array, Array]:
    """Nodes and lengths of Gauss-Legendre quadrature on panels, in a variable that is at rest at both ends of each.

    So square roots, as the horizon makes them, become smooth.
    """
    nodes, lengths = _legendre()
    s = (nodes + 1) / 2
    low, size = edges[:-1, None], np.diff(edges)[:, None]
    return (low + size * s * s * (3 - 2 * s)).ravel(), (size * 3 * s * (1 - s) * lengths).ravel()


@cache
def _legendre() -> tuple[Array, Array]:
    """Nodes in -1 .. 1 and weights; an eigenvalue problem, so it is solved once."""
    nodes, lengths = np.polynomial.legendre.leggauss(_NODES)
    return nodes, lengths


def _visible(theta: float, t: Array) -> Array:
    """Up to which azimuth, 0 .. pi from where the normal is, a circle of radius t around R is above the horizon."""
    low = -math.cos(theta) * np.cos(t)
    rise = math.sin(theta) * np.sin(t)
    ratio = np.divide(low, rise, out=np.where(low < 0, -1.0, 1.0), where=np.abs(rise) > 1e-300)
    return np.asarray(np.arccos(np.clip(ratio, -1.0, 1.0)))


def _reflect(theta: float, t: Array) -> Array:
    """Integrals of 1, V.R and V.T over the visible part of the circles around R; T is across R, towards the normal."""
    far = _visible(theta, t)
    integrals = np.array([2 * far, 2 * far * np.cos(t), 2 * np.sin(far) * np.sin(t)])
    return np.asarray(np.sin(t) * integrals)


def _half(theta: float, h: Array) -> Array:
    """The same for H on circles of radius h around N: V = 2 (L.H) H - L, and dV = 4 (L.H) dH.

    With c the cosine of the azimuth, L.H = a + b c, H.R = a - b c and V.N = 2 (L.H) cos h - cos(theta).
    """
    far = _visible(theta, 2 * h)
    sine = np.sin(far)
    #: integrals of 1, c, c^2 and c^3 over the visible azimuths
    powers = [2 * far, 2 * sine, far + sine * np.cos(far), 2 * sine - 2 / 3 * sine**3]
    a, b = math.cos(theta) * np.cos(h), math.sin(theta) * np.sin(h)
    along = [2 * a * a - math.cos(2 * theta), np.zeros_like(h), -2 * b * b]
    upward = [2 * a * np.cos(h) - math.cos(theta), 2 * b * np.cos(h), np.zeros_like(h)]
    sums = [_times(a, b, [np.ones_like(h)], powers), *(_times(a, b, part, powers) for part in (along, upward))]
    across = (sums[2] - math.cos(theta) * sums[1]) / math.sin(theta) if theta else np.zeros_like(h)
    return np.asarray(4 * np.sin(h) * np.array([sums[0], sums[1], across]))


def _times(a: Array, b: Array, polynomial: list[Array], powers: list[Array]) -> Array:
    """The integral of (a + b c) times a polynomial in c."""
    return np.asarray(sum(p * (a * powers[k] + b * powers[k + 1]) for k, p in enumerate(polynomial)))
