"""What the lobes of a run send off beside Phong's, in short."""

import math
from typing import Any

from phongbench.analysis.rows import HEADLINE_ALPHA, nearest
from phongbench.formulas.formula import Formula
from phongbench.results.formula_columns import FORMULA
from phongbench.results.records import Records, first_of

#: of several squarings the one that is shown, or the nearest
GAMMA = 8


def beside_phong(moments: Records) -> list[dict[str, Any]]:
    """A row for each formula and pair of vectors, for light along the normal, at the exponent nearest to 50.

    moments  rows of the table `moments`, in the order of its file
    returns  name (its first lambda form and slope, the gamma nearest to 8), alpha, and light, momentum and half width
             over those of Phong; no rows without the table
    """
    rows = moments.at(incidence_degrees=0.0)
    if not rows:
        return []
    ratios = ["energy_ratio", "momentum_ratio", "half_width_ratio"]
    lobes = rows.at(alpha=nearest(rows.distinct("alpha"), HEADLINE_ALPHA)).rows([*FORMULA, "alpha", *ratios])
    order = sorted(enumerate(lobes), key=lambda one: (_far(one[1]["gamma"]), one[0]))
    kept = {id(row) for row in first_of((row for _, row in order), ["approximation", "space"])}
    return [
        {
            "name": str(Formula.of_row(row)),
            "alpha": float(row["alpha"]),
            "light": float(row["energy_ratio"]),
            "momentum": float(row["momentum_ratio"]),
            "half width": float(row["half_width_ratio"]),
        }
        for row in lobes
        if id(row) in kept
    ]


def _far(gamma: int | None) -> float:
    """How many doublings from GAMMA."""
    return 0.0 if gamma is None else abs(math.log2(gamma) - math.log2(GAMMA))
