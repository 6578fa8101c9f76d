"""Command lines that bring rows back: what a reader types to get a dot of a figure again."""

import shlex
from collections.abc import Iterable
from typing import Any

import pandas as pd

from phongbench.analysis.rows import Rows
from phongbench_reports.text import missing


def _joined(values: Iterable[Any]) -> str:
    kept = {value for value in values if not missing(value) and value != "none"}
    return ",".join(f"{value:g}" if isinstance(value, float | int) else str(value) for value in sorted(kept))


def reproduce(study: Rows, rows: pd.DataFrame) -> str:
    """The `phongbench run` command that measures these accuracy rows again: same seed, same samples, no timing.

    rows   frame with the key columns of accuracy.parquet; every value that occurs is named, quoted for a shell
    """
    plan = study.run.manifest.get("plan", {}) | {"with": study.run.manifest.get("with", [])}
    names = {"--only": "approximation", "--lambda": "lambda_form", "--gamma": "gamma", "--alpha": "alpha"}
    names |= {"--precision": "precision"}
    words = ["phongbench", "run"]
    for extra in plan.get("with", None) or []:
        words += ["--with", str(extra)]
    for option, column in names.items():
        text = _joined(rows[column].dropna().unique().tolist())
        if text:
            words += [option, text]
    if plan.get("samples"):
        words += ["--samples", str(plan["samples"])]
    words += ["--seed", str(study.run.manifest.get("seed", 0)), "--no-timing"]
    return shlex.join(words)
