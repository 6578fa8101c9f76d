"""What each skip of a scene is worth, and our tracer beside a plain one: measured in one run, interleaved."""

import statistics
import time
from dataclasses import fields, replace
from typing import Any

import numpy as np

from phongbench.lighting import Skips, Specular
from phongbench.progress import Progress
from phongbench.scene import plain
from phongbench.scene.parts import Scene
from phongbench.scene.rendering import Rendered, render
from phongbench.scene.thrift import PATCHES, Thrift

#: rounds of all variants, in turn; ratios are taken within a round, so that a slow spell of the machine hits both
ROUNDS = 9
_SILENT = Progress()


def variants() -> dict[str, Thrift]:
    """Everything left out, then one switch off each, one on, then only exact skips, then none; the first is shipped."""
    full = Thrift()
    found = {"all": full}
    for name in ("objects", "background", "shadow_rays"):
        switched: dict[str, Any] = {name: False}
        found[f"without {name}"] = replace(full, **switched)
    found["without cutoff"] = replace(full, cutoff=0.0)
    # a cutoff alone leaves out what reflects nothing, too
    found["without reflectivity, cutoff"] = replace(full, reflectivity=False, cutoff=0.0)
    for f in fields(Skips):
        if f.type is bool:
            found[f"without {f.name}"] = replace(full, shading=replace(full.shading, **{f.name: False}))
    # off unless asked for: it pays under many lights only
    found["with constant_patches"] = replace(full, shading=replace(full.shading, constant_patches=PATCHES))
    return {**found, "exact": Thrift.exact(), "none": Thrift.none()}


def skips(scene: Scene, *, rounds: int = ROUNDS, progress: Progress = _SILENT, **wishes: Any) -> list[dict[str, Any]]:
    """A row for each of `variants`: what it takes, and what it changes in the picture.

    seconds          the least
    ratio            median over the rounds of the time over that of "all"; ratio_low and ratio_high its quartiles
    same_bits        whether the picture is that of "none", bit for bit
    largest_change   against the picture of "none", linear light
    wishes           of `render`: size, depth, ...
    """
    chosen = variants()
    progress.stage(f"skips of {scene.name}", (rounds + 1) * len(chosen))
    seconds: dict[str, list[float]] = {name: [] for name in chosen}
    pictures: dict[str, Any] = {}

    def once(name: str) -> Rendered:
        done = render(scene, thrift=chosen[name], **wishes)
        progress.advance()
        return done

    for name in chosen:  # compiles, warms up, and shows what changes
        pictures[name] = once(name).picture
    names = list(chosen)
    for number in range(rounds):
        for name in names[number % len(names) :] + names[: number % len(names)]:
            seconds[name].append(once(name).seconds["total"])
    rows = []
    for name in chosen:
        ratios = [mine / full for mine, full in zip(seconds[name], seconds["all"], strict=True)]
        low, middle, high = _quartiles(ratios)
        change = float(np.abs(pictures[name] - pictures["none"]).max())
        rows.append({
            "variant": name, "seconds": round(min(seconds[name]), 6), "ratio": middle, "ratio_low": low,
            "ratio_high": high, "same_bits": bool(np.array_equal(pictures[name], pictures["none"])),
            "largest_change": change,
        })  # fmt: skip
    return rows


def tracers(scene: Scene, *, rounds: int = 5, progress: Progress = _SILENT, **wishes: Any) -> list[dict[str, Any]]:
    """A row for ours, exact Phong with the shipped skips, and one for the plain NumPy tracer of the same scene.

    The same rays but those that the cutoff leaves out; both in float32, ours on every core, NumPy as NumPy does it.
    mrays_per_second  million rays, shadow rays not counted
    ratio             median over the rounds of its time over ours
    largest_difference, pixels_off  against ours: the largest, and the share of pixels that differ by more than a code
    """
    progress.stage(f"tracers of {scene.name}", 2 * rounds)
    size, depth, shadows = (wishes.get(name) for name in ("size", "depth", "shadows"))
    ours: list[float] = []
    theirs: list[float] = []
    render(scene, specular=Specular(), size=size, depth=depth, shadows=shadows)
    for _ in range(rounds):
        fast = render(scene, specular=Specular(), size=size, depth=depth, shadows=shadows)
        ours.append(fast.seconds["total"])
        progress.advance()
        started = time.perf_counter()
        slow, rays = plain.trace(scene, size=size, depth=depth, shadows=shadows, dtype=np.float32)
        theirs.append(time.perf_counter() - started)
        progress.advance()
    off = np.abs(slow - fast.picture).max(axis=2)
    _, ratio, _ = _quartiles([b / a for a, b in zip(ours, theirs, strict=True)])
    height, width = off.shape
    return [
        _tracer("phongbench", width, height, fast.rays, min(ours), 1.0, 0.0, 0.0),
        _tracer(
            "plain NumPy", width, height, rays, min(theirs), ratio, float(off.max()), float((off > 1 / 255).mean())
        ),
    ]


def _tracer(
    name: str, width: int, height: int, rays: int, seconds: float, ratio: float, difference: float, off: float
) -> dict[str, Any]:
    return {
        "tracer": name, "size": f"{width}x{height}", "rays": rays, "seconds": round(seconds, 6),
        "mrays_per_second": rays / seconds / 1e6, "ratio": ratio, "largest_difference": difference, "pixels_off": off,
    }  # fmt: skip


def _quartiles(values: list[float]) -> tuple[float, float, float]:
    low, middle, high = statistics.quantiles(values, n=4) if len(values) > 1 else (values[0],) * 3
    return low, middle, high
