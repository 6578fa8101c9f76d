"""Probe `scenes`: what formulas do to pictures of the shipped scenes, and what those pictures did not need.

Errors and counts are the same on every machine; times are a table of their own, without rows where the plan wants no
timing. Beside the pictures: polygons under far lights (far.py), and (N.H) against (R.V) at infinity (infinity.py).
"""

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from phongbench.accuracy.probes import directional_lights, far_lights, skipped_work
from phongbench.accuracy.probes.probe import ProbeContext
from phongbench.formulas.formula import Formula
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.spec import Approximation
from phongbench.inputs.plan import Plan
from phongbench.results.schema import SCENE_TIMES, SCENES, SKIPS
from phongbench.scenes import picture_errors
from phongbench.scenes.render import render
from phongbench.scenes.scene import Scene
from phongbench.scenes.scene_files import examples, read_scene
from phongbench.shading.specular_term import EXACT
from phongbench.timing.interleaved import clocked, interleaved
from phongbench.timing.statistics import MIN_ROUNDS

#: pictures of studies with at least so many samples
SIZES = {1 << 17: (640, 360), 1 << 14: (320, 180), 0: (64, 36)}
#: what a picture takes on one thread, without timing: seconds a scene, and a megapixel more
_SCENE_SECONDS, _MEGAPIXEL_SECONDS = 0.5, 10.5


def measure(context: ProbeContext) -> Mapping[str, pd.DataFrame]:
    """The tables scenes, skips, scene_times and far."""
    plan = context.plan
    chosen = drawn(plan, context.registry)
    scenes = [read_scene(name) for name in examples()]
    share = 1 / (len(scenes) + 1)  # and one for polygons and vectors
    errors: list[dict[str, Any]] = []
    saved: list[dict[str, Any]] = []
    times: list[dict[str, Any]] = []
    for scene in scenes:
        options: dict[str, Any] = {"size": size(plan), "threads": context.jobs}
        rows = picture_errors.compare(scene, chosen, registry=context.registry, **options)
        errors += [_row(scene, plan, row) for row in rows]
        context.advance(share / 4)
        if plan.timing:
            fitting = [formula for formula, row in zip(chosen, rows, strict=True) if row["left_out"] is None]
            times += _times(scene, fitting, plan, options | {"registry": context.registry})
        context.advance(share / 4)
        found, seconds = skipped_work.measure(scene, plan, options)
        context.violations += skipped_work.violations(found)
        saved, times = [*saved, *found], [*times, *seconds]
        context.advance(share / 2)
    polygons = far_lights.measure(plan)
    if plan.timing:
        times += directional_lights.measure(plan)
    context.advance(share)
    _tell(context, errors)
    return {
        "scenes": SCENES.frame(errors),
        "skips": SKIPS.frame(saved),
        "scene_times": SCENE_TIMES.frame(times),
        "far": polygons,
    }


def seconds(plan: Plan, jobs: int) -> float:
    """What the probe is expected to take; compiled, on a quiet machine."""
    width, height = size(plan)
    each = _SCENE_SECONDS + _MEGAPIXEL_SECONDS * width * height / 1e6 / jobs
    return 5 + len(examples()) * each * (MIN_ROUNDS if plan.timing else 1)


def size(plan: Plan) -> tuple[int, int]:
    """Width and height of the plan's pictures, by its samples."""
    return next(size for least, size in SIZES.items() if plan.samples >= least)


def drawn(plan: Plan, registry: Mapping[str, Approximation] = REGISTRY) -> list[Formula]:
    """Of the usual formulas of pictures, and the user's own, those that the plan measures.

    A slope that an own formula has by itself is drawn, whatever the plan's: so is it measured.
    """
    return [
        s
        for s in (*picture_errors.USUAL, *picture_errors.own(registry))
        if s.approximation in plan.approximations
        and s.lambda_form in ("none", *plan.lambda_forms)
        and (s.gamma is None or s.gamma in plan.gammas)
        and (s.slope in plan.slopes or s.slope == registry[s.approximation].slopes[0])
    ]


def _tell(context: ProbeContext, errors: list[dict[str, Any]]) -> None:
    """A note for each of the user's own formulas that is missing in pictures: in how many, and why in the first."""
    missing: dict[str, list[dict[str, Any]]] = {}
    for row in errors:
        if row["left_out"] and row["approximation"] not in REGISTRY:
            missing.setdefault(row["approximation"], []).append(row)
    for name, rows in missing.items():
        drawn = sum(row["approximation"] == name for row in errors)
        context.note(
            f"{name} is left out of {len(rows)} of {drawn} pictures; {rows[0]['scene']}: {rows[0]['left_out']}"
        )


def _row(scene: Scene, plan: Plan, row: dict[str, Any]) -> dict[str, Any]:
    """A row of the table from one of `formulas.compare`."""
    width, height = size(plan)
    alike = not row["left_out"] and row["max_abs"] == 0
    return {
        **row,
        "scene": scene.name,
        "width": width,
        "height": height,
        "depth": scene.picture.depth,
        "beta_policy": row["beta"],
        "lobe_max": row.get("lobe_error"),
        "psnr": np.inf if alike else row.get("psnr"),
    }


def _times(scene: Scene, fitting: list[Formula], plan: Plan, options: dict[str, Any]) -> list[dict[str, Any]]:
    """Times of the pictures of formulas that fit the scene, rays included, over that of exact Phong."""
    calls = {formula: clocked(partial(render, scene, specular=formula, **options)) for formula in (EXACT, *fitting)}
    times = interleaved(calls, warm=1, seed=plan.seed)
    width, height = size(plan)
    return [
        {
            "scene": scene.name,
            "kind": "formula",
            "name": str(formula),
            "formula": str(formula),
            "setting": np.nan,
            "against": "phong",
            "elements": width * height,
            "depth": scene.picture.depth,
            **times.row(formula, EXACT),
        }
        for formula in calls
    ]
