"""A made-up run for the report's tests: error rows from the formulas themselves, invented but plausible times.

The report must not care whether the engine measured these rows, so nothing here imports the engine.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd
import pytest

import phongbench_reports
from phongbench.formulas.fresnel.reflectance import CHANNELS
from phongbench.inputs.optical_constants import EXACT, in_terms_of
from phongbench.results.schema import MESHES, RAW, TABLES, UNSAID

Vector = npt.NDArray[np.float64]
LENGTHS = (1e-4, 3.7e-4, 1.75e-3, 1e-2, 5e-2, 0.1)
UNIT_ROUNDOFF = {"float16": 2.0**-11, "float32": 2.0**-24, "float64": 2.0**-53}
STRATA = {"highlight": 1.0, "uniform": 1.0, "peak": 0.02, "cutoff": 0.1, "grazing": 0.01}


@dataclass(frozen=True)
class MadeUpRun:
    """Same attributes as phongbench.results.runs.Run."""

    path: Path
    manifest: dict[str, Any]
    accuracy: pd.DataFrame
    timing: pd.DataFrame
    worst: pd.DataFrame
    meshes: pd.DataFrame = field(default_factory=MESHES.frame)
    behaviour: pd.DataFrame = field(default_factory=pd.DataFrame)
    smoothness: pd.DataFrame = field(default_factory=pd.DataFrame)
    moments: pd.DataFrame = field(default_factory=TABLES["moments"].frame)
    cuts: pd.DataFrame = field(default_factory=TABLES["cuts"].frame)
    incidence: pd.DataFrame = field(default_factory=TABLES["incidence"].frame)
    incidence_times: pd.DataFrame = field(default_factory=TABLES["incidence_times"].frame)
    inverse: pd.DataFrame = field(default_factory=TABLES["inverse"].frame)
    scenes: pd.DataFrame = field(default_factory=TABLES["scenes"].frame)
    skips: pd.DataFrame = field(default_factory=TABLES["skips"].frame)
    scene_times: pd.DataFrame = field(default_factory=TABLES["scene_times"].frame)
    far: pd.DataFrame = field(default_factory=TABLES["far"].frame)
    costs: pd.DataFrame = field(default_factory=lambda: cost_rows("gcn4", "rdna2"))

    @property
    def frames(self) -> tuple[pd.DataFrame, ...]:
        """All tables, in the order of the fields."""
        first = self.accuracy, self.timing, self.worst, self.meshes, self.behaviour, self.smoothness
        return *first, self.moments, self.cuts, self.incidence, self.incidence_times, self.inverse


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


def timing_rows(accuracy: pd.DataFrame) -> pd.DataFrame:
    keys = ["approximation", "lambda_form", "space", "gamma", "precision"]
    kernels = accuracy[keys].drop_duplicates().sort_values(keys).to_dict("records")
    plain = {"lambda_form": "none", "space": "reflect", "gamma": None, "precision": "float32"}
    kernels += [{"approximation": name, **plain} for name in ("aa-twin", "copy", "triad", "dot")]
    base = {"phong": 1.05, "aa-twin": 1.05, "schlick": 0.45, "gaussian": 0.72, "integer-power": 0.41, "lyon": 0.30}
    base |= {"copy": 0.12, "triad": 0.20, "dot": 0.28}
    form = {"dot": 0.0, "difference": 0.02, "cross": 0.07, "none": 0.0}
    rows = []
    for index, kernel in enumerate(kernels):
        gamma = 1 if pd.isna(kernel["gamma"]) else kernel["gamma"]
        ns = base.get(kernel["approximation"], 0.5) + form[kernel["lambda_form"]] + 0.012 * np.log2(gamma)
        ns *= 2.6 if kernel["precision"] == "float16" else 1.0
        for working_set, floor in (("l1", 0.0), ("l2", 0.34), ("memory", 1.9)):
            time = max(ns, floor) * (1.0 + 0.004 * np.sin(index))
            ratio = time / max(1.05, floor)
            twin = kernel["approximation"] in ("phong", "aa-twin")
            ratio, half = (1.0, 0.004) if twin else (ratio, 0.02 * ratio)
            rows.append(
                {
                    **kernel,
                    "beta_policy": "none",
                    "working_set": working_set,
                    "elements": 1024,
                    "threads": 1,
                    "ns_min": time,
                    "ns_median": 1.03 * time,
                    "ratio": ratio,
                    "ratio_low": ratio - half,
                    "ratio_high": ratio + half,
                    "dot_ratio": time / max(0.28, floor),
                    "rounds": 24,
                    "contaminated": 0,
                    "verdict": "unresolved" if twin else "faster" if ratio + half < 0.98 else "slower",
                    "bandwidth_fraction": min(1.0, max(floor, 0.1) / time),
                }
            )
    return pd.DataFrame(rows)


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


def mesh_rows(accuracy: pd.DataFrame) -> pd.DataFrame:
    """Lyon on two surfaces and a file: raw normals are short by a quarter of the edge squared, as across a quad."""
    keys = ["approximation", "lambda_form", "space", "beta_policy", "alpha", "gamma", "beta", "precision", "gated"]
    cells = accuracy[accuracy["approximation"].eq("lyon") & accuracy["gated"] & accuracy["precision"].eq("float32")]
    rows = []
    for cell, mesh, edge in product(
        cells[cells["beta_policy"] == "taylor"][keys].drop_duplicates().to_dict("records"),
        ("icosphere", "torus", "some.obj"),
        (2.0, 5.0, 10.0, 20.0),
    ):
        x = 1.0 - np.linspace(0.0, min(1.0, 12.0 / cell["alpha"]), 101)
        exact, model, short = x ** cell["alpha"], value(cell, x), np.radians(edge) ** 2 / 4
        for pair, normals in product(("classic", "lengthwise", "half"), ("raw", "renormalised")):
            e = {"classic": -4.0, "lengthwise": -2.0, "half": -1.0}[pair] * short if normals == "raw" else 0.0
            of = metrics(exact, model, value(cell, x, e), 1e-6)
            kept = ("max_abs", "mean_abs", "rms", "codes_8bit", "model_max", "length_max", "nonfinite", "above_one")
            rows.append(
                {
                    **cell,
                    "mesh": mesh,
                    "edge_degrees": edge,
                    "triangles": 800,
                    "left_out": 3 * (mesh == "some.obj"),
                    "normals": normals,
                    "pair": pair,
                    "space": "half" if pair == "half" else "reflect",
                    "truth": "interpolated",
                    "samples": 8192,
                    **{name: of[name] for name in kept},
                }
            )
    return pd.DataFrame(rows).astype({"gamma": "Int64"}) if rows else MESHES.frame()


BLINN = {"approximation": "blinn", "lambda_form": "none", "space": "half", "beta_policy": "taylor", "gamma": None}


def moment_rows(alphas: tuple[float, ...], gammas: tuple[int, ...]) -> pd.DataFrame:
    """Lobes as much brighter and wider as their names sort later; the horizon takes the cosine of the incidence."""
    lobes = [*cells(alphas, gammas), *(BLINN | {"alpha": alpha} for alpha in alphas)]
    names = sorted({lobe["approximation"] for lobe in lobes})
    rows = []
    for lobe, degrees in product(lobes, (0.0, 45.0, 89.0)):
        ratio = 1.0 + 0.1 * (names.index(lobe["approximation"]) - names.index("phong"))
        energy = ratio * 6.28 / (lobe["alpha"] + 1) * np.cos(np.radians(degrees))
        half = {"half_width_degrees": 60 * ratio / lobe["alpha"] ** 0.5, "half_width_ratio": ratio}
        sums = {"energy": energy, "energy_ratio": ratio, "momentum": energy, "momentum_ratio": ratio, "sideways": 0.0}
        rows.append(lobe | {"incidence_degrees": degrees} | sums | half)
    return TABLES["moments"].frame(rows)


def cut_rows(gammas: tuple[int, ...]) -> pd.DataFrame:
    """Phong's and Lyon's steps at 90 degrees, and a power of N.H without any."""
    lobes = [lobe for lobe in cells((0.1, 1.0, 5.0), gammas) if lobe["lambda_form"] in ("dot", "none")]
    steps = {"phong": 0.0175, "lyon": 0.35, "gaussian": 0.37, "schlick": 0.1}
    rows = [
        lobe | {"cut_degrees": 90.0, "step": steps[name] ** lobe["alpha"], "codes": 255 * steps[name] ** lobe["alpha"]}
        for lobe in lobes
        if (name := lobe["approximation"]) in steps and lobe["beta_policy"] != "minimax"
    ]
    return TABLES["cuts"].frame([*rows, *(BLINN | {"alpha": a, "at_90": 4.0**-a} for a in (0.1, 1.0, 5.0))])


#: formula of reflectance -> nanoseconds that it is taken to need
REFLECTANCES = {"constant": 0.06, "schlick": 0.1, "f82": 0.12, "dielectric": 0.7, "conductor": 1.0}


def incidence_rows() -> pd.DataFrame:
    """Errors of reflectances at a few angles, by the plain bodies."""
    degrees = np.linspace(0.0, 90.0, 31)
    rows = []
    for material, exact in EXACT.items():
        for kind, number in product(REFLECTANCES, range(3)):
            if (fresnel := in_terms_of(exact, kind)) is None:
                continue
            body, truth = fresnel.bound(number), exact.bound(number)
            error = np.array([abs(body(v) - truth(v)) for v in np.cos(np.radians(degrees)).tolist()])
            key = {"material": material, "reflectance": kind, "precision": "float32", "channel": CHANNELS[number]}
            where = {"worst_degrees": float(degrees[error.argmax()]), "within_degrees": 37.0, "samples": 31}
            sizes = {"max_abs": error.max() + 1e-8, "mean_abs": error.mean(), "codes_8bit": 255 * error.max()}
            rows.append(key | where | sizes | {"error_60": float(error[20]), "error_85": float(error[28])})
    return TABLES["incidence"].frame(rows)


def incidence_times() -> pd.DataFrame:
    rows = []
    for (kind, ns), base in product(REFLECTANCES.items(), ("dielectric", "conductor")):
        ratio = ns / REFLECTANCES[base]
        ends = {"ratio": ratio, "ratio_low": 0.98 * ratio, "ratio_high": 1.03 * ratio}
        key = {"reflectance": kind, "precision": "float32", "against": base}
        rows.append(key | {"elements": 2048, "rounds": 48, "ns": ns} | ends)
    return TABLES["incidence_times"].frame(rows)


def inverse_rows(alphas: tuple[float, ...]) -> pd.DataFrame:
    """Errors of normals that fall with the exponent, as much larger as their formulas stand later."""
    models = (("phong", "none", "none", None), ("lyon", "dot", "taylor", 8), ("lyon", "dot", "minimax", 32))
    models += (("gaussian", "dot", "taylor", None), ("schlick", "none", "none", None), ("matt", "none", "none", None))
    rows = []
    for (place, (name, form, slope, gamma)), alpha in product(enumerate(models), alphas):
        lobe = {"approximation": name, "lambda_form": form, "space": "reflect", "beta_policy": slope}
        key = lobe | {"alpha": alpha, "gamma": gamma, "surface": "sphere", "lights": 4, "noise": "none"}
        mean = place / alpha
        sizes = {"mean_degrees": mean, "median_degrees": 0.5 * mean, "max_degrees": 10 * mean, "far_share": 0.1}
        more = {"depth_rmse": 0.01 * mean, "residual_rms": 0.001 * mean, "evaluations": 24.0}
        rows.append(key | {"samples": 1384, "known": 1384} | sizes | more)
    return TABLES["inverse"].frame(rows)


def cost_rows(*targets: str) -> pd.DataFrame:
    """That the run has costs on these targets: exact Phong's; the others' are looked up in the tables that ship."""
    phong = {"approximation": "phong", "lambda_form": "none", "space": "reflect", "beta_policy": "none", "gamma": None}
    told = {"cost_kind": "compiled", "tool": "RADV", "tool_version": "Mesa 22", "unit": "cycles", "cost": 6.0}
    row = {**phong, **RAW, **told, "precision": "float32", "alpha": 50.0, "context": 0, "reads": 0, "ratio": 1.0}
    return TABLES["costs"].frame([row | {"target": target} for target in targets])


def make_run(
    path: Path,
    *,
    name: str = "20250101-120000-0123abcd",
    alphas: tuple[float, ...] = (10.0, 20.0, 50.0, 128.0, 200.0),
    gammas: tuple[int, ...] = (2, 4, 8, 16, 32, 64),
    precisions: tuple[str, ...] = ("float32", "float16"),
) -> MadeUpRun:
    rows = [row for cell in cells(alphas, gammas) for precision in precisions for row in rows_of(cell, precision)]
    accuracy = pd.DataFrame(rows).assign(**RAW, **UNSAID["accuracy"]).astype({"gamma": "Int64", "beta": "float64"})
    timing = timing_rows(accuracy).assign(**RAW).astype({"gamma": "Int64"})
    provenance = {
        "python": "3.11.7",
        "numpy": "2.4.6",
        "cpu": {"model": "Example CPU", "cores": 2},
        "command": "phongbench run",
    }
    manifest = {
        "schema": 1,
        "run": name,
        "state": "complete",
        "seed": 20250101,
        "code": "abc123",
        "provenance": provenance,
        "plan": {"alphas": list(alphas), "samples": 131072, "preset": "quick"},
        "files": {},
    }
    made = (worst_rows(accuracy), mesh_rows(accuracy), behaviour_rows(accuracy), smoothness_rows(accuracy))
    tables = (table.assign(**RAW) for table in made)
    lobes = (moment_rows(alphas, gammas), cut_rows(gammas))
    return MadeUpRun(
        path, manifest, accuracy, timing, *tables, *lobes, incidence_rows(), incidence_times(), inverse_rows(alphas)
    )


@pytest.fixture(scope="session")
def made_up() -> Callable[..., MadeUpRun]:
    """Factory of made-up runs; keyword arguments as in make_run."""
    return make_run


@pytest.fixture(scope="session")
def run(tmp_path_factory: pytest.TempPathFactory) -> MadeUpRun:
    return make_run(tmp_path_factory.mktemp("run"))


@pytest.fixture(scope="session")
def report(run: MadeUpRun, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of that run's report."""
    return phongbench_reports.build(run, tmp_path_factory.mktemp("report")).parent
