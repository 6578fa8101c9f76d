"""What a formula does to normals: pictures drawn with exact Phong, inverted with each formula in its place.

Known surfaces are lit from around the viewer, their pictures inverted from the true normals on: what is measured is the
model's error and not the search's. One light leaves a turn around itself open: its normals are those nearest to the
truth that explain the picture. In float64; forms that are equal on unit vectors are measured once. A standard study has
thousands of formulas and exponents, so some exponents stand for all, and noise is added to the sphere's pictures only.
"""

import math
from collections.abc import Iterable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import Any

import numpy as np
import pandas as pd

from phongbench.accuracy.probes.lobes import columns, takes
from phongbench.accuracy.probes.probe import ProbeContext
from phongbench.compiler.precisions import Array
from phongbench.formulas.formula import Formula
from phongbench.inputs.plan import Plan
from phongbench.inverse.photometric import Normals, invert_pictures
from phongbench.inverse.surface_heights import HeightEquations
from phongbench.inverse.surface_model import PhotometricLight, SurfaceModel
from phongbench.inverse.surfaces import SURFACES, KnownSurface, degrees_between, known_surface
from phongbench.results.inverse_table import INVERSE

#: pixels of a picture's side
SIZE = 48
#: strengths of the terms; the lights' angle from the viewer in degrees, and where around him the first one is
DIFFUSE, SPECULAR, SLANT, FIRST = 0.7, 0.5, 30.0, 0.3
LIGHTS = (1, 4)
#: exponents that stand for all
ALPHAS = (10.0, 20.0, 50.0, 100.0, 200.0, 1000.0)
#: noise of pictures: none, Gaussian with a standard deviation of a code, or rounding to codes, which saturates
NOISES = ("none", "gaussian", "8bit")
CODE = 1 / 255
#: the model without a highlight, as it stands among the formulas
MATT = "matt"
#: an error beyond this many degrees is counted
FAR = 1.0


def measure(context: ProbeContext) -> Mapping[str, pd.DataFrame]:
    """The table inverse: rows of every formula and exponent of the study, and of the model without a highlight."""
    cells = [cell for position, cell in enumerate(context.sweep.cells) if position not in context.sweep.failures]
    wanted = dict.fromkeys((c.formula, c.alpha) for c in cells if not c.formula.raw)
    some = chosen_alphas(context.plan.alphas)
    studied = [pair for pair in wanted if pair[1] in some and takes(*pair, context.registry)]
    alphas = sorted({alpha for _, alpha in studied})
    first = {_key(formula, alpha): (formula, alpha) for formula, alpha in reversed(studied)}
    seed = context.plan.seed
    models: dict[Any, SurfaceModel] = {
        key: SurfaceModel(0.0, DIFFUSE, SPECULAR, alpha, formula, context.registry)
        for key, (formula, alpha) in first.items()
    }
    models |= {(MATT, alpha): SurfaceModel(0.0, DIFFUSE, 0.0, alpha) for alpha in alphas}

    def inverted(key: Any) -> list[dict[str, Any]]:
        found = list(rows(models[key], seed))
        context.advance(1 / len(models))
        return found

    with ThreadPoolExecutor(max(1, context.jobs)) as pool:
        known = dict(zip(models, pool.map(inverted, models), strict=True))
    table = [columns(f, alpha) | row for f, alpha in studied for row in known[_key(f, alpha)]]
    table += [columns(Formula(MATT), alpha) | row for alpha in alphas for row in known[MATT, alpha]]
    return {"inverse": INVERSE.frame(table)}


def seconds(plan: Plan, jobs: int) -> float:
    """Measured: 0.04 s a formula and exponent; every form is a cell twice, in each precision."""
    share = len(chosen_alphas(plan.alphas)) / len(plan.alphas)
    return 0.04 * share * sum(1 for _ in plan.cells()) / (2 * len(plan.precisions) * jobs)


def chosen_alphas(alphas: Iterable[float]) -> list[float]:
    """Those of a study's exponents that are nearest to ALPHAS."""
    known = sorted(alphas)
    return sorted({min(known, key=lambda one: abs(math.log(one / wanted))) for wanted in ALPHAS})


def rows(model: SurfaceModel, seed: int) -> Iterator[dict[str, Any]]:
    """A row for each surface, number of lights and noise."""
    for name in SURFACES:
        surface = known_surface(name, SIZE)
        for count in LIGHTS:
            for noise in NOISES if name == "sphere" else NOISES[:1]:
                drawn = pictures(name, count, noise, model.alpha, seed)
                limit = 1.0 if noise == "8bit" else np.inf
                found = invert_pictures(
                    drawn, lights(count), model, mask=surface.mask, start=surface.normals, saturation=limit
                )
                key = {"surface": name, "lights": count, "noise": noise}
                yield key | errors(surface, found, name) | {"evaluations": _evaluations(found, count)}


@cache
def lights(count: int) -> tuple[PhotometricLight, ...]:
    """Lights evenly around the viewer."""
    slant, turns = math.radians(SLANT), FIRST + 2 * math.pi * np.arange(count) / count
    at = math.sin(slant)
    return tuple(PhotometricLight.of((at * math.cos(t), at * math.sin(t), math.cos(slant))) for t in turns)


@cache
def pictures(surface: str, count: int, noise: str, alpha: float, seed: int) -> Array:
    """Pictures (count, SIZE, SIZE) by exact Phong, 0 outside the surface."""
    known = known_surface(surface, SIZE)
    towards = np.array([light.direction for light in lights(count)])
    facing = np.einsum("hwc,kc->khw", known.normals, towards)
    mirrored = 2 * facing * known.normals[..., 2] - towards[:, 2, None, None]
    shine = np.where(facing > 0, np.maximum(mirrored, 0.0) ** alpha, 0.0)
    drawn = (DIFFUSE * np.maximum(facing, 0.0) + SPECULAR * shine) * known.mask
    if noise == "gaussian":
        place = [seed, list(SURFACES).index(surface), count]
        drawn = drawn + np.random.default_rng(place).normal(0.0, CODE, drawn.shape)
    elif noise == "8bit":
        drawn = np.rint(np.clip(drawn, 0.0, 1.0) / CODE) * CODE
    return np.asarray(drawn)


def errors(surface: KnownSurface, found: Normals, name: str) -> dict[str, Any]:
    """How far normals and heights are from the known ones."""
    known = surface.mask & np.isfinite(found.normals[..., 0])
    result = {"samples": int(surface.mask.sum()), "known": int(known.sum()), **_angles(np.zeros(0))}
    if known.any():
        turned = degrees_between(found.normals[known], surface.normals[known])
        result |= _angles(turned) | {"residual_rms": float(np.sqrt(np.mean(found.residual[known] ** 2)))}
    facing = bool((found.normals[..., 2][known] > 0.05).all())
    result["depth_rmse"] = math.nan
    if facing and known.any():
        equations = _equations(name) if (known == surface.mask).all() else HeightEquations.of(known)
        off = (equations.heights(found.normals) - surface.heights)[known]
        result["depth_rmse"] = float(np.std(off) / np.ptp(surface.heights[surface.mask]))
    return result


def _angles(degrees: Array) -> dict[str, float]:
    """Statistics of angles; NaN of none."""
    if not len(degrees):
        return dict.fromkeys(("mean_degrees", "median_degrees", "max_degrees", "far_share", "residual_rms"), math.nan)
    return {
        "mean_degrees": float(degrees.mean()),
        "median_degrees": float(np.median(degrees)),
        "max_degrees": float(degrees.max()),
        "far_share": float((degrees > FAR).mean()),
    }


@cache
def _equations(name: str) -> HeightEquations:
    return HeightEquations.of(known_surface(name, SIZE).mask)


def _evaluations(found: Normals, count: int) -> float:
    """Of the formula, for each pixel: twice for each light and step, the second time for the derivative."""
    steps = found.steps[np.isfinite(found.steps)]
    return 2.0 * count * float(steps.mean()) if len(steps) else math.nan


def _key(formula: Formula, alpha: float) -> Any:
    """Formulas of one key are equal on unit vectors."""
    form = "dot" if formula.lambda_form == "difference" else formula.lambda_form
    return formula.approximation, form, formula.gamma, formula.slope, formula.space, alpha
