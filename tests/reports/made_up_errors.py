"""Made-up rows of errors: from the formulas themselves, with an invented rounding.

The report must not care whether the engine measured them, so nothing here imports the engine.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

Vector = npt.NDArray[np.float64]


LENGTHS = (1e-4, 3.7e-4, 1.75e-3, 1e-2, 5e-2, 0.1)


UNIT_ROUNDOFF = {"float16": 2.0**-11, "float32": 2.0**-24, "float64": 2.0**-53}


STRATA = {"highlight": 1.0, "uniform": 1.0, "peak": 0.02, "cutoff": 0.1, "grazing": 0.01}


#: a cause of wrong lengths -> the lengths |a| - 1 and |b| - 1 that it is taken to leave
CAUSES = {"rsqrt-12": (3e-4, -3e-4), "rsqrt-bits-1": (-1.75e-3, -1.75e-3), "interpolated-10": (-3.8e-3, 0.0)}


def deficit(form: str, x: Vector, e: float, d: float) -> Vector:
    a, b = 1.0 + e, 1.0 + d
    return {
        "dot": 1.0 - a * b * x,
        "difference": 0.5 * (a * a + b * b - 2.0 * a * b * x),
        "cross": 0.5 * (a * b) ** 2 * (1.0 - x * x),
    }[form]


def value(cell: dict[str, Any], x: Vector, e: float = 0.0, d: float = 0.0) -> Vector:
    alpha, name = cell["alpha"], cell["approximation"]
    cosine = np.maximum((1.0 + e) * (1.0 + d) * x, 0.0)
    if name in ("phong", "integer-power"):
        return np.asarray(cosine**alpha)
    if name == "schlick":
        return np.asarray(cosine / (alpha - alpha * cosine + cosine))
    if name == "gaussian":
        offset = 0.663 if cell["beta_policy"] == "minimax" else 0.0
        return np.exp(-(alpha + offset) * deficit(cell["lambda_form"], x, e, d))
    return np.asarray(np.maximum(0.0, 1.0 - cell["beta"] * deficit(cell["lambda_form"], x, e, d)) ** cell["gamma"])


def cells(alphas: tuple[float, ...], gammas: tuple[int, ...]) -> Iterator[dict[str, Any]]:
    common = {"space": "reflect", "gamma": None, "beta": None, "lambda_form": "none", "beta_policy": "none"}
    for alpha in alphas:
        yield {**common, "approximation": "phong", "alpha": alpha}
        yield {**common, "approximation": "integer-power", "alpha": alpha}
        yield {**common, "approximation": "schlick", "alpha": alpha}
        for form, policy in product(("dot", "difference", "cross"), ("taylor", "minimax")):
            shape = {**common, "alpha": alpha, "lambda_form": form, "beta_policy": policy}
            yield {**shape, "approximation": "gaussian"}
            for gamma in gammas:
                c = (lambda n: 0.6626 + 0.268 / n) if policy == "minimax" else (lambda n: 0.0)
                beta = (alpha + c(alpha)) / (gamma + c(gamma))
                yield {**shape, "approximation": "lyon", "gamma": gamma, "beta": beta}


def metrics(exact: Vector, model: Vector, given: Vector, noise: float) -> dict[str, Any]:
    error = given - exact
    size = np.abs(error)
    worst = float(size.max()) + noise
    return {
        "max_abs": worst,
        "mean_abs": size.mean(),
        "rms": np.sqrt((error**2).mean()),
        "bias": error.mean(),
        "p50_abs": np.median(size),
        "p99_abs": 0.99 * worst,
        "p999_abs": 0.999 * worst,
        "max_above": max(float(error.max()), noise),
        "max_below": max(float(-error.min()), noise),
        "codes_8bit": 255 * worst,
        "model_max": np.abs(model - exact).max(),
        "length_max": np.abs(given - model).max(),
        "rounding_max": noise,
        "coverage": "sampled",
        "nonfinite": 0,
        "excluded": 0,
        "above_one": int((given > 1.0).sum()),
        "negative": 0,
    }


def rows_of(cell: dict[str, Any], precision: str) -> Iterator[dict[str, Any]]:
    alpha = cell["alpha"]
    x = 1.0 - np.linspace(0.0, min(1.0, 12.0 / alpha), 301)
    exact, model = x**alpha, value(cell, x)
    roundoff = UNIT_ROUNDOFF[precision]
    noise = roundoff * (alpha if cell["lambda_form"] in ("dot", "none") else (cell["gamma"] or 4) * 0.3)
    key = {
        **cell,
        "precision": precision,
        "gated": True,
        "perturbation": "none",
        "length_error": 0.0,
        "samples": 131072,
    }
    for stratum, share in STRATA.items():
        measured = metrics(exact, exact + share * (model - exact), exact + share * (model - exact), noise)
        yield {**key, "stratum": stratum, "truth": "angle", **measured}
    yield {**key, "stratum": "grazing", "gated": False, "truth": "angle", **metrics(exact, model, model, noise)}
    hostile = {"nonfinite": 12 if cell["lambda_form"] == "none" else 3, "excluded": 40, "samples": 4096}
    yield {**key, "stratum": "hostile", "truth": "angle", **metrics(exact, model, model, noise), **hostile}
    for sign, size, how in product((1, -1), LENGTHS, ("a", "both", "opposite")):
        e = sign * size
        d = {"a": 0.0, "both": e, "opposite": -e}[how]
        given = value(cell, x, e, d)
        for truth in ("angle", "given"):
            against = exact if truth == "angle" else ((1.0 + e) * (1.0 + d) * x) ** alpha
            change = {"stratum": "lengths", "perturbation": how, "length_error": e, "truth": truth}
            yield {**key, **change, **metrics(against, against + model - exact, given, noise)}

    for cause, (e, d) in CAUSES.items():
        given = value(cell, x, e, d)
        for truth in ("angle", "given"):
            against = exact if truth == "angle" else ((1.0 + e) * (1.0 + d) * x) ** alpha
            change = {"stratum": "lengths", "perturbation": cause, "length_error": e, "truth": truth}
            yield {**key, **change, **metrics(against, against + model - exact, given, noise)}


def behaviour_rows(accuracy: pd.DataFrame) -> pd.DataFrame:
    """Every formula and form with three hostile cases; the ungated cross form shines at a = -b."""
    keys = ["approximation", "lambda_form", "space", "beta_policy", "alpha", "gamma", "beta", "precision", "gated"]
    cells = accuracy[accuracy["alpha"] == accuracy["alpha"].min()].drop_duplicates(
        ["approximation", "lambda_form", "precision", "gated"]
    )[keys]
    rows = []
    for cell in cells.to_dict("records"):
        ghost = cell["lambda_form"] == "cross" and not cell["gated"]
        huge = "infinite" if cell["lambda_form"] in ("dot", "none") else "saturates"
        for case, outcome, low, high, exact in (
            ("a is zero", "saturates", 0.0, 0.0, np.nan),
            ("a is huge", huge, 0.0, 1.0, 1.0),
            ("a = -b", "saturates" if ghost else "value", 0.0, float(ghost), 0.0),
            ("alpha 0 at the peak", "value", 1.0, 1.0, 1.0),
        ):
            rows.append({**cell, "case": case, "outcome": outcome, "lowest": low, "highest": high, "exact": exact})
    return pd.DataFrame(rows).astype({"gamma": "Int64"})


def smoothness_rows(accuracy: pd.DataFrame) -> pd.DataFrame:
    """Edges by the law of gamma; rises in the dot form of float16 alone."""
    keys = ["approximation", "lambda_form", "space", "beta_policy", "alpha", "gamma", "beta", "precision", "gated"]
    rows = accuracy.drop_duplicates(keys)[keys].reset_index(drop=True)
    banded = (rows["lambda_form"] == "dot") & (rows["precision"] == "float16")
    gamma = rows["gamma"].astype("float64")
    return rows.assign(
        samples=2560,
        overflows=0,
        subnormals=np.where(rows["precision"] == "float16", 300, 0),
        rises=np.where(banded, 200, 0),
        largest_rise=np.where(banded, 0.05, 0.0),
        kink=(2 / gamma) ** (gamma / 2) * 32.0 ** (2 - gamma),
        kink_degrees=np.degrees(np.arccos(np.clip(1 - gamma / rows["alpha"], 0, 1))),
    )


def worst_rows(accuracy: pd.DataFrame) -> pd.DataFrame:
    keys = ["approximation", "lambda_form", "space", "beta_policy", "alpha", "gamma", "precision", "gated", "stratum"]
    picked = accuracy[accuracy["stratum"].isin(["highlight", "lengths"]) & (accuracy["truth"] == "angle")]
    worst = picked.sort_values("max_abs", ascending=False).drop_duplicates(keys)
    worst = worst[[*keys, "perturbation", "length_error", "truth", "max_abs"]].rename(columns={"max_abs": "error"})
    worst["rank"], worst["exact"] = 1, 0.25
    worst["value"] = worst["exact"] + worst["error"]
    for column, number in zip(("ax", "ay", "az", "bx", "by", "bz"), (0.0, 0.0, 1.0, 0.1, 0.0, 0.995), strict=True):
        worst[column] = float(np.float32(number)).hex()
    return worst.reset_index(drop=True)
