"""How coarse a mesh may be before normals that are left raw show: read from the rows of the probe `meshes`."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from phongbench.results.records import Records, Row, key

#: the gamma that is shown, or the measured one nearest to it
GAMMA = 8
#: an 8-bit channel's step
CODE = 1 / 255
REACHES = ("alpha", "lambda_form", "pair", "gamma", "degrees", "relation")
PAIRS = ("classic", "lengthwise", "half")


def widest_edge(edges: Sequence[float], changes: Sequence[float], limit: float = CODE) -> tuple[float, str]:
    """The edge angle up to which a change stays within a limit, on every mesh.

    edges    degrees, in any order; several meshes may be mixed
    changes  the largest change measured at each
    returns  the angle, and how it was got: "=" between two measured edges, along a power law; "<" already the finest
             edge, the one returned, changes more; ">" even the coarsest, the one returned, does not
    """
    order = np.argsort(edges, kind="stable")
    x, y = np.asarray(edges, np.float64)[order], np.maximum.accumulate(np.asarray(changes, np.float64)[order])
    beyond = int(np.searchsorted(y, limit, side="right"))
    if beyond == 0:
        return float(x[0]), "<"
    if beyond == len(x):
        return float(x[-1]), ">"
    last = max(y[beyond - 1], 1e-12)
    share = np.log(limit / last) / np.log(y[beyond] / last)
    return float(x[beyond - 1] * (x[beyond] / x[beyond - 1]) ** share), "="


def reaches(meshes: Records, limit: float = CODE) -> list[Row]:
    """How wide edges may be at each exponent, in each form and with each kind of pair, if normals stay raw.

    meshes   rows of meshes.parquet
    returns  rows of REACHES, with degrees and relation as of `widest_edge`, for Lyon's formula with its gamma nearest
             to GAMMA; what counts is how much the same formula changes when its normals are made unit first
    """
    groups: dict[tuple[Any, ...], list[Row]] = {}
    kind = key(REACHES[:4])
    for row in raw_lyon(meshes).rows([*REACHES[:4], "edge_degrees", "length_max"]):
        groups.setdefault(kind(row), []).append(row)
    return [
        dict(zip(REACHES, (*named, *widest_edge(*_edges(groups[named]), limit)), strict=True))
        for named in sorted(groups)
    ]


def _edges(rows: Sequence[Row]) -> tuple[list[float], list[float]]:
    return [row["edge_degrees"] for row in rows], [row["length_max"] for row in rows]


def raw_lyon(meshes: Records, normals: str = "raw") -> Records:
    """Lyon's rows at the gamma nearest to GAMMA, against the interpolated normal made unit."""
    return lyon(meshes).at(normals=normals)


def lyon(meshes: Records) -> Records:
    """Lyon's rows at the gamma nearest to GAMMA, against the interpolated normal made unit, whatever the normals."""
    rows = meshes.at(approximation="lyon", truth="interpolated")
    gamma = min(rows.distinct("gamma"), key=lambda g: abs(np.log2(float(g) / GAMMA)), default=None)
    return rows if gamma is None else rows.at(gamma=gamma)


def in_words(degrees: float, relation: str) -> str:
    """The angle as words: "5.2°", "< 2°", "> 20°"."""
    return f"{'' if relation == '=' else relation + ' '}{degrees:.2g}°"
