"""What the lobes of a run send off beside Phong's, in short."""

from typing import Any

import numpy as np
import pandas as pd

from phongbench.analysis.front import records
from phongbench.analysis.rows import HEADLINE_ALPHA, at, near
from phongbench.formulas.formula import Formula

#: of several squarings the one that is shown, or the nearest
GAMMA = 8


def beside_phong(moments: pd.DataFrame) -> list[dict[str, Any]]:
    """A row for each formula and pair of vectors, for light along the normal, at the exponent nearest to 50.

    moments  rows of the table `moments`, in the order of its file
    returns  name (its first lambda form and slope, the gamma nearest to 8), alpha, and light, momentum and half width
             over those of Phong; no rows without the table
    """
    rows = near(at(moments, incidence_degrees=0.0), "alpha", HEADLINE_ALPHA)
    if rows.empty:
        return []
    gammas = rows["gamma"].astype("float64")
    far = (np.log2(gammas) - np.log2(GAMMA)).abs().fillna(0.0)
    first = rows.assign(far=far).sort_values("far", kind="stable").drop_duplicates(["approximation", "space"])
    return [
        {
            "name": str(Formula.of_row(row)),
            "alpha": float(row["alpha"]),
            "light": float(row["energy_ratio"]),
            "momentum": float(row["momentum_ratio"]),
            "half width": float(row["half_width_ratio"]),
        }
        for row in records(first.sort_index())
    ]
