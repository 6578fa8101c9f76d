"""Tables made by hand, of the columns that the claims' rules read."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import pandas as pd

from phongbench.analysis.claims import CLAIMS
from phongbench.analysis.rows import Rows
from phongbench.results.schema import ACCURACY, MESHES, RAW, TABLES, TIMING

CODE = 1 / 255


@dataclass(frozen=True)
class Tables:
    """What judge reads of a run."""

    accuracy: pd.DataFrame = field(default_factory=ACCURACY.frame)
    timing: pd.DataFrame = field(default_factory=TIMING.frame)
    meshes: pd.DataFrame = field(default_factory=MESHES.frame)
    skips: pd.DataFrame = field(default_factory=TABLES["skips"].frame)
    scene_times: pd.DataFrame = field(default_factory=TABLES["scene_times"].frame)
    far: pd.DataFrame = field(default_factory=TABLES["far"].frame)
    incidence: pd.DataFrame = field(default_factory=TABLES["incidence"].frame)
    cuts: pd.DataFrame = field(default_factory=TABLES["cuts"].frame)
    costs: pd.DataFrame = field(default_factory=TABLES["costs"].frame)
    manifest: dict[str, Any] = field(default_factory=lambda: {"run": "by-hand", "state": "complete"})


def accuracy(rows: Iterable[dict[str, Any]]) -> pd.DataFrame:
    usual = RAW | {
        "approximation": "lyon",
        "lambda_form": "dot",
        "space": "reflect",
        "beta_policy": "taylor",
        "alpha": 50.0,
        "gamma": 8,
        "beta": 1.0,
        "precision": "float32",
        **RAW,
        "gated": True,
        "stratum": "highlight",
        "perturbation": "none",
        "length_error": 0.0,
        "truth": "angle",
        "samples": 1000,
        "max_abs": 0.0,
        "length_max": 0.0,
        "coverage": "sampled",
    }
    frame = pd.DataFrame([usual | row for row in rows]).reindex(columns=ACCURACY.names)
    return frame.astype({"gamma": "Int64"})


def timing(rows: Iterable[dict[str, Any]]) -> pd.DataFrame:
    usual = RAW | {
        "approximation": "phong",
        "lambda_form": "none",
        "space": "reflect",
        "beta_policy": "none",
        "gamma": None,
        "precision": "float32",
        **RAW,
        "working_set": "l1",
        "threads": 1,
        "ratio": 1.0,
        "verdict": "unresolved",
    }
    told = [usual | row for row in rows]
    told = [{"ratio_low": 0.99 * row["ratio"], "ratio_high": 1.01 * row["ratio"]} | row for row in told]
    return pd.DataFrame(told).reindex(columns=TIMING.names).astype({"gamma": "Int64"})


def meshes(rows: Iterable[dict[str, Any]]) -> pd.DataFrame:
    usual = RAW | {
        "mesh": "icosphere",
        "normals": "raw",
        "pair": "classic",
        "approximation": "lyon",
        "lambda_form": "cross",
        "space": "reflect",
        "beta_policy": "taylor",
        "alpha": 50.0,
        "gamma": 8,
        "precision": "float32",
        **RAW,
        "gated": True,
        "truth": "interpolated",
    }
    columns = list(dict.fromkeys([*MESHES.names, "length_max"]))
    return pd.DataFrame([usual | row for row in rows]).reindex(columns=columns).astype({"gamma": "Int64"})


def table(name: str, rows: Iterable[dict[str, Any]]) -> pd.DataFrame:
    """Any other table, made of the columns that a rule reads."""
    return pd.DataFrame(list(rows)).reindex(columns=TABLES[name].names)


def judged(key: str, **tables: pd.DataFrame) -> dict[str, Any]:
    claim = next(one for one in CLAIMS if one.key == key)
    return claim.judge(Rows(Tables(**tables))).as_dict()


def lyon(errors: dict[float, float], **more: Any) -> list[dict[str, Any]]:
    return [{"alpha": alpha, "max_abs": error} | more for alpha, error in errors.items()]
