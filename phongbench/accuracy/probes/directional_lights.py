"""What shading a surface takes by (R.V)^alpha and by (N.H)^alpha', light and viewer at infinity or near."""

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np

from phongbench.accuracy.probes.far_lights import alphas
from phongbench.compiler.precisions import Array
from phongbench.formulas.formula import Formula
from phongbench.inputs.plan import Plan
from phongbench.shading.lighting import WHITE, Light, Material, Skips, Viewer
from phongbench.shading.shade import shade
from phongbench.timing.interleaved import clocked, interleaved

#: points of the surface, and of a study with fewer samples
POINTS, FEW_POINTS = 1 << 17, 1 << 12
#: rounds: a call takes a millisecond, so there may be more of them than of pictures
ROUNDS = 32
#: where light and viewer are
PLACES = {
    "infinity": (Light(direction=(0.3, 0.5, 1.0)), Viewer(direction=(-0.2, 0.1, 1.0))),
    "near": (Light(position=(3.0, 5.0, 10.0)), Viewer(position=(-2.0, 1.0, 10.0))),
}
#: model -> its exponent over Phong's: (N.H)^(4 alpha) is a highlight of the same width
MODELS = {"phong": 1.0, "blinn-phong": 4.0}
#: what stands for the power: the exact one, which takes longer than making any vector, and a few squarings
FORMULAS = {name: Formula.parse(name) for name in ("phong", "lyon:dot:8")}
#: no block is left out: what both compute, not what they skip
_SKIPS = Skips(lights_behind=False, beyond_support=False, dark_tail=False)
#: the same call once more: it must not be told apart
TWIN = "phong again"


def measure(plan: Plan) -> list[dict[str, Any]]:
    """Rows of scene_times: each model in each place, its ratio to Phong there."""
    points = surface(POINTS if plan.samples >= POINTS // 2 else FEW_POINTS, plan.seed)
    rows = []
    for alpha in alphas(plan):
        calls = {key: clocked(call) for key, call in _calls(points, alpha)}
        times = interleaved(calls, rounds=ROUNDS, warm=1, seed=plan.seed)
        rows += [
            {
                "scene": place,
                "kind": "shading",
                "name": name,
                "formula": formula,
                "setting": alpha,
                "against": "phong",
                "elements": len(points),
                "depth": 0,
                **times.row((place, formula, name), (place, formula, "phong")),
            }
            for place, formula, name in times.names
        ]
    return rows


def surface(count: int, seed: int) -> Array:
    """Points of the unit sphere's upper half, float32 (n, 3): also their own normals."""
    found = np.random.default_rng(seed).normal(size=(count, 3))
    found /= np.linalg.norm(found, axis=1, keepdims=True)
    found[:, 2] = np.abs(found[:, 2])
    return np.ascontiguousarray(found, np.float32)


def _calls(points: Array, alpha: float) -> Iterator[tuple[tuple[str, str, str], Callable[[], object]]]:
    """(place, formula, name), call: for each place and formula Phong, the same again, and Blinn-Phong."""
    out = np.empty_like(points)
    for place, (light, viewer) in PLACES.items():
        for formula, specular in FORMULAS.items():
            for name, model in (("phong", "phong"), (TWIN, "phong"), ("blinn-phong", "blinn-phong")):
                material = Material(diffuse=WHITE, specular=WHITE, shininess=MODELS[model] * alpha)
                yield (
                    (place, formula, name),
                    partial(
                        shade,
                        points,
                        points,
                        material=material,
                        lights=[light],
                        viewer=viewer,
                        model=model,
                        specular=specular,
                        skips=_SKIPS,
                        normalise=False,
                        out=out,
                    ),
                )
