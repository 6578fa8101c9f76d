"""What a run measured on an adapter of this machine: times in each context, errors, and how far a model of it is off.

Where an adapter's name tells its family, and that is compiled for, the compiler's ratio to exact Phong stands beside
the measured one: both hold the whole highlight, dot product included.
"""

import re

import numpy as np
import pandas as pd

from phongbench.analysis.rows import Rows, at
from phongbench.results.formula_columns import FORMULA, RAW
from phongbench.results.schema import GPU, NO_FORMULAS

#: what drivers call the chips of a family; the first that fits counts
FAMILIES = (
    (r"\bRX (?:9060|9070|7\d{3})|NAVI3\d|GFX11", "rdna3"),
    (r"\bRX 6\d{3}|NAVI2\d|GFX103", "rdna2"),
    (r"\bVega\b|\bRadeon VII\b|VEGA\d+", "gcn5"),
    (r"\bRX (?:4[678]0|5[5-9]0)\b|POLARIS", "gcn4"),
    (r"\bRTX 50\d\d\b|\bRTX PRO \d+ Blackwell", "sm120"),
    (r"\bRTX 40\d\d\b|\bL4\b|\bL40S?\b|\bRTX \d+ Ada", "sm89"),
    (r"\bRTX 30\d\d\b|\bA10\b|\bA40\b|\bRTX A\d+", "sm86"),
    (r"\bRTX 20\d\d\b|\bGTX 16\d\d\b|\bT4\b", "sm75"),
    (r"\bH100\b|\bH200\b|\bGH200\b", "sm90"),
)
_KEY = [*FORMULA, *RAW, "alpha"]


def family_of(adapter: str) -> str | None:
    """The compiled target whose chips an adapter's name is of; None where it tells none, or software."""
    if "no GPU" in adapter:
        return None
    return next((target for words, target in FAMILIES if re.search(words, adapter, re.IGNORECASE)), None)


def measured(rows: Rows) -> pd.DataFrame:
    """One row for each formula of (R, V) that was timed on the adapter, cheapest first; empty where none was.

    ns, ratio, ratio_low, ratio_high   in no context
    in_<multiply-adds>, reading        ns that it adds where the shader does as much around, or reads memory; NaN if it
                                       was not timed there
    model, off                         the compiler's ratio on the adapter's family, and measured over it; NaN likewise
    float32, float16                   largest error found on the device at the row's exponent; NaN likewise
    """
    costs = at(rows.raw("costs"), target=GPU)
    costs = costs[~costs["approximation"].isin(NO_FORMULAS) & (costs["space"] == "reflect")]
    if costs.empty:
        return costs
    bare = at(costs, context=0, reads=0).rename(columns={"cost": "ns"})
    table = bare[[*_KEY, "ns", "ratio", "ratio_low", "ratio_high"]]
    for context in sorted(set(costs["context"]) - {0}):
        table = _beside(table, at(costs, context=context), "cost", f"in_{context}")
    table = _beside(table, at(costs, context=0)[at(costs, context=0)["reads"] > 0], "cost", "reading")
    family = family_of(str(rows.run.manifest.get("gpu", {}).get("adapter", "")))
    compiled = at(rows.raw("costs"), target=family or "", context=0, reads=0)
    table = _beside(table, compiled, "ratio", "model")
    table = _beside(table, _worst(rows, "float32"), "max_abs", "float32")
    table = _beside(table, _worst(rows, "float16"), "max_abs", "float16")
    return table.assign(off=table["ratio"] / table["model"]).sort_values(["ratio", *_KEY], ignore_index=True)


def _worst(rows: Rows, precision: str) -> pd.DataFrame:
    """Of each formula the largest error on the device on unit vectors, or on any where it removes lengths."""
    errors: pd.DataFrame | None = getattr(rows.run, "device_accuracy", None)
    if errors is None or errors.empty:
        return pd.DataFrame(columns=[*_KEY, "max_abs"])
    errors = at(errors, precision=precision, truth="angle")
    told = (errors["perturbation"] == "none") | (errors["normalise"] != "none")
    return errors[told].groupby(_KEY, dropna=False, observed=True)[["max_abs"]].max().reset_index()


def _beside(table: pd.DataFrame, other: pd.DataFrame, column: str, name: str) -> pd.DataFrame:
    """The table with a column of another one of the same formulas, NaN where that lacks them."""
    if other.empty:
        return table.assign(**{name: np.nan})
    other = other[[*_KEY, column]].rename(columns={column: name}).drop_duplicates(_KEY)
    return table.merge(other.astype({key: table[key].dtype for key in _KEY}), on=_KEY, how="left")
