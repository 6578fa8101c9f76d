"""Gouraud shading: light at the corners of triangles, which pictures mix inside them.

Colours are those that the camera sees, in a mirror too: a highlight does not move when it is reflected. Shadows fall on
corners and run out inside the triangles; a mirror reflects along the interpolated normal, as under Phong shading.
"""

import time

import numpy as np

from phongbench.compiler.precisions import Array
from phongbench.scenes.geometry import COLOURS
from phongbench.scenes.skips import Tally
from phongbench.scenes.wavefront import RenderJob, Worker
from phongbench.shading import tiles

#: how far above a corner a shadow ray starts, in lifts of its triangle: the others that meet there have their own, and
#: are steeper
_LIFTS = 8
#: corners that are shaded together
_AT_ONCE = 1 << 14


def colours(job: RenderJob, tally: Tally) -> Array:
    """The colours of the corners of triangles that are Gouraud shaded, seen from the camera; 0 of all others.

    tally    what was left out is added
    returns  float32 (9, t)
    """
    g = job.geometry
    mixed = np.zeros((9, len(g.modes)), np.float32)
    material_of = g.materials[len(g.materials) - len(g.modes) :, 0]
    shaded = np.flatnonzero(g.modes == COLOURS)
    if not len(shaded):
        return mixed
    worker = Worker(job, min(_AT_ONCE, len(shaded)))
    for material in range(len(job.shadings)):
        mine = shaded[material_of[shaded] == material]
        for first in range(0, len(mine), _AT_ONCE):
            part = mine[first : first + _AT_ONCE]
            for corner in range(0, 9, 3):
                mixed[corner : corner + 3, part] = _lit(worker, material, corner, part)
    tally.add(worker.tally)
    return mixed


def _lit(worker: Worker, material: int, corner: int, part: Array) -> Array:
    """Colours (3, n) of one corner of these triangles."""
    job, tally, started = worker.job, worker.tally, time.perf_counter()
    g = job.geometry
    points, normals = (np.ascontiguousarray(rows[corner : corner + 3, part].T) for rows in (g.corners, g.normals))
    starts = points + _LIFTS * g.faces[3, part, None] * normals
    lit, counts, shading = np.empty_like(points), np.zeros(tiles.COUNTS, np.int64), job.shadings[material]
    lost = tally.lost[0, material : material + 1]
    shading.shade(points, normals, lit, counts, lost, visible=worker.visible((points, starts, normals)))
    tally.lost[:, material] = np.maximum(tally.lost[:, material], lost[0])  # they may be seen after any reflection
    tally.add_pairs(shading.skipped(len(points), counts))
    tally.shading += time.perf_counter() - started
    return lit.T
