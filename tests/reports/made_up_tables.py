"""Made-up rows of a run's other tables: times, meshes, lobes, reflectance, normals and costs."""

from __future__ import annotations

from itertools import product

import numpy as np
import pandas as pd
from made_up_errors import cells, metrics, value

from phongbench.formulas.fresnel.reflectance import CHANNELS
from phongbench.inputs.optical_constants import EXACT, in_terms_of
from phongbench.results.schema import MESHES, RAW, TABLES


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
