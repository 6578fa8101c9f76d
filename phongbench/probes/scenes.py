"""Probe `scenes`: what formulas do to pictures of the shipped scenes, and what those pictures did not need.

Errors and counts are the same on every machine; times are a table of their own, without rows where the plan wants no
timing. Beside the pictures: polygons under far lights (far.py), and (N.H) against (R.V) at infinity (infinity.py).
"""

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from phongbench.approximations import REGISTRY
from phongbench.columns import SCENE_COLUMNS, SCENE_TIME_COLUMNS, SKIP_COLUMNS
from phongbench.lighting import Specular
from phongbench.plan import Plan
from phongbench.probes import far, infinity, skips
from phongbench.probes.probing import Probing
from phongbench.probes.turns import ROUNDS, in_turn, over
from phongbench.scene import formulas
from phongbench.scene.parts import Scene
from phongbench.scene.reading import examples, read_scene
from phongbench.scene.rendering import render

#: pictures of studies with at least so many samples
SIZES = {1 << 17: (640, 360), 1 << 14: (320, 180), 0: (64, 36)}
#: what a picture takes on one thread, without timing: seconds a scene, and a megapixel more
_SCENE_SECONDS, _MEGAPIXEL_SECONDS = 2.0, 40.0
_NUMBERS = (
    "max_abs", "mean_abs", "rms", "psnr", "visible", "flip", "energy", "highlight_area", "lobe_max",
)  # fmt: skip


def measure(probing: Probing) -> Mapping[str, pd.DataFrame]:
    """The tables scenes, skips, scene_times and far."""
    plan = probing.plan
    chosen = drawn(plan)
    if own := [name for name in plan.approximations if name not in REGISTRY]:
        probing.note(f"scenes are drawn by shipped formulas only, so without {', '.join(own)}")
    scenes = [read_scene(name) for name in examples()]
    share = 1 / (len(scenes) + 1)  # and one for polygons and vectors
    errors: list[dict[str, Any]] = []
    saved: list[dict[str, Any]] = []
    times: list[dict[str, Any]] = []
    for scene in scenes:
        wishes: dict[str, Any] = {"size": size(plan), "threads": probing.jobs}
        errors += [_row(scene, plan, row) for row in formulas.compare(scene, chosen, rounds=0, **wishes)]
        probing.advance(share / 4)
        if plan.timing:
            times += _times(scene, chosen, plan, wishes)
        probing.advance(share / 4)
        found, seconds = skips.measure(scene, plan, wishes)
        probing.violations += skips.violations(found)
        saved, times = [*saved, *found], [*times, *seconds]
        probing.advance(share / 2)
    polygons = far.measure(plan)
    if plan.timing:
        times += infinity.measure(plan)
    probing.advance(share)
    return {"scenes": _errors(errors), "skips": _skips(saved), "scene_times": _all_times(times), "far": polygons}


def seconds(plan: Plan, jobs: int) -> float:
    """What the probe is expected to take; compiled, on a quiet machine."""
    width, height = size(plan)
    each = _SCENE_SECONDS + _MEGAPIXEL_SECONDS * width * height / 1e6 / jobs
    return 5 + len(examples()) * each * (ROUNDS if plan.timing else 1)


def size(plan: Plan) -> tuple[int, int]:
    """Width and height of the plan's pictures, by its samples."""
    return next(size for least, size in SIZES.items() if plan.samples >= least)


def drawn(plan: Plan) -> list[Specular]:
    """Of the usual formulas of pictures those that the plan measures: its names, lambda forms, gammas and slopes."""
    return [
        s for s in formulas.USUAL
        if s.approximation in plan.approximations and (s.lambda_form is None or s.lambda_form in plan.lambda_forms)
        and (s.gamma is None or s.gamma in plan.gammas) and (s.beta is None or s.beta in plan.slopes)
    ]  # fmt: skip


def _row(scene: Scene, plan: Plan, row: dict[str, Any]) -> dict[str, Any]:
    """A row of the table from one of `formulas.compare`."""
    width, height = size(plan)
    spec = REGISTRY[row["approximation"]]
    alike = not row["left_out"] and row["max_abs"] == 0
    return {
        **row, "scene": scene.name, "width": width, "height": height, "depth": scene.picture.depth,
        "lambda_form": row["lambda_form"] or spec.lambda_forms[0], "beta_policy": row["beta"] or spec.slopes[0],
        "lobe_max": row.get("lobe_error"), "psnr": np.inf if alike else row.get("psnr"),
    }  # fmt: skip


def _times(scene: Scene, chosen: list[Specular], plan: Plan, wishes: dict[str, Any]) -> list[dict[str, Any]]:
    """Times of the formulas' pictures, rays included, over that of exact Phong; those that fit the scene."""
    fitting = [Specular(), *(s for s in chosen if formulas.why_not(scene, s) is None)]
    calls = [partial(render, scene, specular=formula, **wishes) for formula in fitting]
    for call in calls:
        call()
    seconds = in_turn(calls, seed=plan.seed)
    width, height = size(plan)
    return [
        {
            "scene": scene.name, "kind": "formula", "name": name_of(formula), "formula": name_of(formula),
            "setting": np.nan, "against": "phong", "elements": width * height, "depth": scene.picture.depth,
            **over(seconds, n, 0),
        }
        for n, formula in enumerate(fitting)
    ]  # fmt: skip


def name_of(formula: Specular) -> str:
    """A formula as the command line writes it."""
    parts = {name: getattr(formula, name) for name in ("approximation", "lambda_form", "gamma", "beta")}
    return formulas.name_of(parts)


def _errors(rows: list[dict[str, Any]]) -> pd.DataFrame:
    frame = pd.DataFrame(rows, columns=list(SCENE_COLUMNS))
    kinds = dict.fromkeys(_NUMBERS, "float64") | {"gamma": "Int64", "max_codes": "Int64", "left_out": "str"}
    return frame.astype(kinds)


def _skips(rows: list[dict[str, Any]]) -> pd.DataFrame:
    kinds = {"of": "Int64", "skipped": "Int64", "setting": "float64"}
    return pd.DataFrame(rows, columns=list(SKIP_COLUMNS)).astype(kinds)


def _all_times(rows: list[dict[str, Any]]) -> pd.DataFrame:
    kinds = dict.fromkeys(("setting", "seconds", "ratio", "ratio_low", "ratio_high"), "float64")
    return pd.DataFrame(rows, columns=list(SCENE_TIME_COLUMNS)).astype(kinds)
