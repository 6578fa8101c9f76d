"""How coarse a mesh may be before normals that are left raw show: read from the rows of the probe `meshes`."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

#: the gamma that is shown, or the measured one nearest to it
GAMMA = 8
#: an 8-bit channel's step
CODE = 1 / 255
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


def reaches(meshes: pd.DataFrame, limit: float = CODE) -> pd.DataFrame:
    """How wide edges may be at each exponent, in each form and with each kind of pair, if normals stay raw.

    meshes   rows of meshes.parquet
    returns  alpha, lambda_form, pair, gamma, degrees, relation (see `widest_edge`), for Lyon's formula with its gamma
             nearest to GAMMA; what counts is how much the same formula changes when its normals are made unit first
    """
    rows = raw_lyon(meshes)
    widest = [
        (*key, *widest_edge(mine["edge_degrees"].tolist(), mine["length_max"].tolist(), limit))
        for key, mine in rows.groupby(["alpha", "lambda_form", "pair", "gamma"], sort=True)
    ]
    return pd.DataFrame(widest, columns=["alpha", "lambda_form", "pair", "gamma", "degrees", "relation"])


def raw_lyon(meshes: pd.DataFrame, normals: str = "raw") -> pd.DataFrame:
    """Lyon's rows at the gamma nearest to GAMMA, against the interpolated normal made unit."""
    rows = lyon(meshes)
    return rows[rows["normals"] == normals]


def lyon(meshes: pd.DataFrame) -> pd.DataFrame:
    """Lyon's rows at the gamma nearest to GAMMA, against the interpolated normal made unit, whatever the normals."""
    rows = meshes[(meshes["approximation"] == "lyon") & (meshes["truth"] == "interpolated")]
    if rows.empty:
        return rows
    gamma = min(sorted(rows["gamma"].unique()), key=lambda g: abs(np.log2(float(g) / GAMMA)))
    nearest: pd.DataFrame = rows[rows["gamma"] == gamma]
    return nearest


def in_words(degrees: float, relation: str) -> str:
    """The angle as words: "5.2°", "< 2°", "> 20°"."""
    return f"{'' if relation == '=' else relation + ' '}{degrees:.2g}°"
