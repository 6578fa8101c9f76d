"""What a picture did not need, skip by skip and cut-off by cut-off: counts, what changes, what it saves."""

from dataclasses import replace
from functools import partial
from itertools import chain
from typing import Any

import numpy as np

from phongbench.inputs.plan import Plan
from phongbench.scenes import skips
from phongbench.scenes.render import Rendered, render
from phongbench.scenes.scene import Scene
from phongbench.scenes.skips import SceneSkips, Skipped
from phongbench.timing.interleaved import clocked, interleaved

#: contributions below which reflections stop, and how many reflections in a row are followed meanwhile
CUTOFFS, DEEP = (1 / 1020, 1 / 510, 1 / 255, 1 / 64, 1 / 16, 1 / 4), 5
#: ledger line -> variants of `worth` with and without it, where they are not "all" and "without" its name; a cut-off
#: alone leaves out what reflects nothing, too
_PAIRS = {
    "out_of_reach": ("all", "without reach"),
    "vectors_not_built": ("all", "without unused_vectors"),
    "reflectivity": ("without cutoff", "without reflectivity, cutoff"),
}
#: what sums in float32 may add to a bound
ROUNDING = 1e-5

Rows = list[dict[str, Any]]


def measure(scene: Scene, plan: Plan, wishes: dict[str, Any]) -> tuple[Rows, Rows]:
    """Rows of skips and of scene_times, the latter none without timing.

    wishes  of `render`: size and threads
    """
    parts = [_ledger(scene, plan, wishes)]
    if reflects(scene):
        parts.append(_cutoffs(scene, plan, wishes))
    found, times = (list(chain.from_iterable(rows)) for rows in zip(*parts, strict=True))
    return found, times


def reflects(scene: Scene) -> bool:
    """Whether any ray is reflected."""
    return any(material.reflectivity > 0 for material in scene.materials)


def violations(rows: Rows) -> list[str]:
    """Sentences on skips that change more than they may."""
    problems = []
    for row in rows:
        where = f"{row['scene']}: leaving out by {row['name']}"
        if row["kind"] == "exact" and not row["same_bits"]:
            problems.append(f"{where} is exact, but changes the picture by {row['largest_change']:.3g}")
        elif row["largest_change"] > row["bound"] + ROUNDING:
            problems.append(
                f"{where} changes the picture by {row['largest_change']:.3g}, its bound is {row['bound']:.3g}"
            )
    return problems


def _ledger(scene: Scene, plan: Plan, wishes: dict[str, Any]) -> tuple[Rows, Rows]:
    """A line for each skip that can be turned off, but the cut-off; two for all that are exact, and for all."""
    variants = skips.variants()
    done = {name: render(scene, skips=skips, **wishes) for name, skips in variants.items()}
    compared = {line: _PAIRS.get(line.name, ("all", f"without {line.name}")) for line in done["all"].ledger}
    pairs = [(line, *names) for line, names in compared.items() if line.name != "cutoff" and names[1] in variants]
    bound = sum(line.bound for line in done["all"].ledger)
    pairs += [
        (Skipped("all exact", "exact", "", 0, 0), "exact", "none"),
        (Skipped("all", "bounded", "", 0, 0, bound), "all", "none"),
    ]
    rows = [_row(scene, line, done[kept], done[without], scene.picture.depth) for line, kept, without in pairs]
    if not plan.timing:
        return rows, []
    names = list(dict.fromkeys(chain.from_iterable((kept, without) for _, kept, without in pairs)))
    calls = {name: clocked(partial(render, scene, skips=variants[name], **wishes)) for name in names}
    times = interleaved(calls, seed=plan.seed)
    return rows, [
        _time("skip", row, kept, times.row(without, kept)) for row, (_, kept, without) in zip(rows, pairs, strict=True)
    ]


def _cutoffs(scene: Scene, plan: Plan, wishes: dict[str, Any]) -> tuple[Rows, Rows]:
    """A line for each cut-off: all rays that it saves, and what it changes."""
    by_cutoff = {cutoff: replace(SceneSkips(), cutoff=cutoff) for cutoff in (0.0, *CUTOFFS)}
    calls = {cutoff: partial(render, scene, skips=t, depth=DEEP, **wishes) for cutoff, t in by_cutoff.items()}
    done = {cutoff: call() for cutoff, call in calls.items()}
    rows = []
    for cutoff in CUTOFFS:
        bound = next(line.bound for line in done[cutoff].ledger if line.name == "cutoff")
        saved = done[0.0].rays - done[cutoff].rays
        line = Skipped("cutoff", "bounded", "rays", done[0.0].rays, saved, bound)
        rows.append(_row(scene, line, done[cutoff], done[0.0], DEEP) | {"setting": cutoff})
    if not plan.timing:
        return rows, []
    times = interleaved({cutoff: clocked(call) for cutoff, call in calls.items()}, seed=plan.seed)
    return rows, [_time("cutoff", row, "all followed", times.row(row["setting"], 0.0)) for row in rows]


def _row(scene: Scene, line: Skipped, kept: Rendered, without: Rendered, depth: int) -> dict[str, Any]:
    height, width = kept.picture.shape[:2]
    return {
        "scene": scene.name,
        "width": width,
        "height": height,
        "depth": depth,
        "name": line.name,
        "setting": np.nan,
        "kind": line.kind,
        "unit": line.unit,
        "of": line.of,
        "skipped": line.skipped,
        "bound": line.bound,
        "same_bits": bool(np.array_equal(kept.picture, without.picture)),
        "largest_change": float(np.abs(kept.picture - without.picture).max()),
    }


def _time(kind: str, row: dict[str, Any], against: str, found: dict[str, Any]) -> dict[str, Any]:
    """A row of scene_times beside a row of skips."""
    same = {name: row[name] for name in ("scene", "name", "setting", "depth")}
    return {
        **same,
        "kind": kind,
        "against": against,
        "formula": "phong",
        "elements": row["width"] * row["height"],
        **found,
    }
