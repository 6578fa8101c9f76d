"""Configurations: N, L and V, all incidences and azimuths, V around the mirror direction; seeded and addressable.

Configuration i of a stratum is a pure function of (seed, i), as pairs are. R and V are the pair of the highlight
stratum, so a formula sees the same angles here as there.
"""

import math

import numpy as np

from phongbench.compiler.precisions import Array, Precision
from phongbench.inputs.length_errors import spoil
from phongbench.inputs.pairs import highlight_frames, hold
from phongbench.inputs.random_numbers import uniforms
from phongbench.inputs.strata import Stratum

#: the largest angle between N and L, in degrees
STEEPEST = 89.0
#: what is added to a seed for the incidence, and for lengths
_INCIDENCE_SEED, _LENGTHS_SEED = 0x1C1DE, 0x1E6


def configurations(
    stratum: Stratum, precision: Precision, *, seed: int, start: int, count: int, scale: float
) -> tuple[Array, Array]:
    """Configurations start .. start + count of a stratum, as they are held in the working precision.

    scale    1 / alpha: V lies within HIGHLIGHT_REACH of it around the mirror direction, in deficits
    returns  N (3, count), and V above L (6, count), in the precision's carrier
    """
    mirror, view = highlight_frames(seed, start, count, scale)
    normal, light = normals_and_lights(mirror, seed, start)
    vectors: tuple[Array, ...] = (normal, view, light)
    if stratum.cause is not None:
        for v, t in zip(vectors, uniforms(seed + _LENGTHS_SEED, start, count, 3), strict=True):
            spoil(stratum.cause, t, v)
    elif stratum.perturbation == "both":
        vectors = tuple(v * (1 + stratum.length_error) for v in vectors)
    n, vl = vectors[0].astype(precision.carrier), np.concatenate(vectors[1:]).astype(precision.carrier)
    for v in (n, vl):
        hold(precision, v)
    return n, vl


def normals_and_lights(mirror: Array, seed: int, start: int) -> tuple[Array, Array]:
    """Unit N and L, each (3, n), of which these are the mirror directions: all incidences and azimuths."""
    normal = _normals(mirror, uniforms(seed + _INCIDENCE_SEED, start, mirror.shape[1], 3))
    return normal, 2 * (normal * mirror).sum(axis=0) * normal - mirror


def _normals(mirror: Array, random: Array) -> Array:
    """Unit normals 0 .. STEEPEST degrees from unit mirror directions, at any azimuth about them.

    random  (3, n) in [0, 1): incidence, and a direction that the normal leans to
    """
    incidence = math.radians(STEEPEST) * random[0]
    height, turn = 2 * random[1] - 1, 2 * np.pi * random[2]
    flat = np.sqrt(1 - height * height)
    towards = np.stack([flat * np.cos(turn), flat * np.sin(turn), height])
    across = towards - (towards * mirror).sum(axis=0) * mirror
    across /= np.sqrt((across * across).sum(axis=0))
    return np.asarray(np.cos(incidence) * mirror + np.sin(incidence) * across)
