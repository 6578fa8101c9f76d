"""Formulas of reflectance on a front of their own: error over incidence against time, for each material."""

import pandas as pd

from phongbench.analysis.front import states
from phongbench.analysis.rows import Rows, at
from phongbench.formulas.fresnel.catalogue import KINDS
from phongbench.inputs.optical_constants import EXACT

#: columns of `points`
COLUMNS = ["material", "reflectance", "error", "worst_degrees", "ns", "ratio", "ratio_low", "ratio_high", "state"]


def points(rows: Rows, material: str) -> pd.DataFrame:
    """The formulas that can tell a material: columns COLUMNS, the fastest first; empty where nothing was timed.

    error  the largest of the three channels at the judged precision, on the scale of reflectances
    ratio  time over that of the material's exact formula, with its 99 % interval
    state  on, off or unresolved, as of `front.states`
    """
    wrong = at(rows.judged_incidence, material=material).sort_values("max_abs", kind="stable")
    worst = wrong.drop_duplicates("reflectance", keep="last").rename(columns={"max_abs": "error"})
    times = at(rows.incidence_times, precision=rows.incidence_precision, against=EXACT[material].kind)
    joined = worst.merge(times.drop(columns="precision"), on="reflectance").dropna(subset=["ratio_low", "ratio_high"])
    kernel = joined["reflectance"].map({name: place for place, name in enumerate(KINDS)})
    joined["state"] = pd.Series(states(joined["error"], joined["ratio_low"], joined["ratio_high"], kernel), dtype="str")
    return joined.sort_values(["ratio", "reflectance"], kind="stable").reset_index(drop=True)[COLUMNS]


def twin_differs(rows: Rows) -> bool:
    """Whether an exact formula, timed twice, was told apart from itself: then no time is told."""
    twins = rows.incidence_times
    twins = twins[~twins["reflectance"].isin(list(KINDS)) & (twins["against"] == "conductor")]
    return bool(((twins["ratio_low"] > 1) | (twins["ratio_high"] < 1)).any())
