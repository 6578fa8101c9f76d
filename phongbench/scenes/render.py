"""Pictures of scenes: rays traced in tiles on all cores, shaded by the library, and what was left out on the way."""

import os
import time
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from itertools import count as counter
from threading import Lock
from typing import Any

import numpy as np

from phongbench.compiler.precisions import Array
from phongbench.errors import CancelledError, InputError
from phongbench.formulas.formula import Formula
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.spec import Approximation
from phongbench.scenes import camera, gouraud
from phongbench.scenes.geometry import geometry
from phongbench.scenes.scene import MOST_DEPTH, MOST_SUPERSAMPLING, Scene
from phongbench.scenes.scene_files import check_size
from phongbench.scenes.skip_bounds import Bounds
from phongbench.scenes.skips import SceneSkips, Skipped, Tally
from phongbench.scenes.wavefront import RenderJob, Worker
from phongbench.shading.lighting import Viewer
from phongbench.shading.prepared import PreparedShading
from phongbench.shading.specular_term import EXACT
from phongbench.support.progress import Progress

#: samples of a tile's side; 64 and 256 cost 10 % more: calls, or the cache
TILE = 128
_SHIPPED, _SILENT = SceneSkips(), Progress()


@dataclass(frozen=True, eq=False)
class Rendered:
    """A picture and what it took.

    picture  float32 (height, width, 3)  linear light, not limited to 1
    ledger   what was left out
    rays     traced, shadow rays not counted
    seconds  in all, and of the threads together: `tracing` (shadows included) and `shading`
    """

    picture: Array
    ledger: tuple[Skipped, ...]
    rays: int
    seconds: dict[str, float]

    def as_dict(self) -> dict[str, Any]:
        """The numbers, for JSON."""
        height, width = self.picture.shape[:2]
        return {
            "width": width,
            "height": height,
            "rays": self.rays,
            "seconds": self.seconds,
            "ledger": [line.as_dict() for line in self.ledger],
        }


def render(
    scene: Scene,
    *,
    size: tuple[int, int] | None = None,
    depth: int | None = None,
    supersampling: int | None = None,
    shadows: bool | None = None,
    specular: Formula | None = None,
    model: str = "phong",
    skips: SceneSkips = _SHIPPED,
    threads: int | None = None,
    tile: int = TILE,
    progress: Progress = _SILENT,
    cancelled: Callable[[], bool] | None = None,
    registry: Mapping[str, Approximation] = REGISTRY,
) -> Rendered:
    """Draw a scene.

    size, depth, supersampling, shadows  None takes the scene's own
    specular   the formula of the specular term, for materials that name none
    model      "phong" or "blinn-phong"
    skips     what may be left out
    threads    None takes one for each core; the picture does not depend on it
    tile       samples along a tile's side; the picture does not depend on it
    cancelled  asked for each tile; True ends the work
    registry   the approximations that `specular` and materials may name
    Raises InputError for a size or depth beyond the limits and for a formula that does not fit a material, naming it;
    CancelledError if the work was given up.
    """
    started = time.perf_counter()
    scene = _with_settings(scene, size=size, depth=depth, supersampling=supersampling, shadows=shadows)
    tally = Tally()
    job = _job(scene, skips, specular=specular or EXACT, model=model, registry=registry)
    job = replace(job, vertex=gouraud.colours(job, tally))
    (width, height), samples = scene.picture.size, scene.picture.supersampling
    side = max(1, tile // samples)
    firsts = [(x, y) for y in range(0, height, side) for x in range(0, width, side)]
    progress.stage(f"render {scene.name}", len(firsts))
    picture = np.zeros((height, width, 3), np.float32)
    tally.add(_draw(job, firsts, side, picture, threads or os.cpu_count() or 1, progress, cancelled))
    seconds = {"total": time.perf_counter() - started, "tracing": tally.tracing, "shading": tally.shading}
    return Rendered(picture, _ledger(job, tally), tally.rays, {k: round(v, 6) for k, v in seconds.items()})


def _with_settings(scene: Scene, **settings: Any) -> Scene:
    """The scene with these picture settings, where they are not None; InputError beyond the limits."""
    picture = replace(scene.picture, **{name: value for name, value in settings.items() if value is not None})
    check_size(*picture.size)
    for name, low, high in (("depth", 0, MOST_DEPTH), ("supersampling", 1, MOST_SUPERSAMPLING)):
        if not low <= (value := getattr(picture, name)) <= high:
            raise InputError(f"{name} = {value} is outside {low} .. {high}", name)
    return replace(scene, picture=picture)


def _job(scene: Scene, skips: SceneSkips, *, specular: Formula, **options: Any) -> RenderJob:
    """What is to be drawn; options are `model` and `registry` of ShadingOptions. Errors name the material."""
    options |= {"ambient_light": scene.ambient_light, "skips": skips.shading, "normalise": False}
    arrays, viewer, shadowed = geometry(scene), Viewer(position=(0.0, 0.0, 0.0)), scene.picture.shadows
    lights = arrays.space.lights(scene.lights)
    shadings = []
    for material in scene.materials:
        options["specular"] = material.specular or specular
        try:
            shadings.append(PreparedShading(material.reflection, lights, viewer, shadowed=shadowed, **options))
        except InputError as problem:
            about = f"{problem.where}: {problem.what}" if problem.where else problem.what
            raise InputError(about, f"materials.{material.name}", problem.fix) from problem
    dark = np.zeros((9, len(arrays.modes)), np.float32)
    return RenderJob(scene, arrays, lights, shadings, dark, camera.frame(scene.camera, *scene.picture.size), skips)


def _draw(
    job: RenderJob,
    firsts: list[tuple[int, int]],
    side: int,
    picture: Array,
    threads: int,
    progress: Progress,
    cancelled: Callable[[], bool] | None,
) -> Tally:
    """Draw all tiles; threads take them in turn. What all of them counted."""
    height, width = picture.shape[:2]
    samples = job.scene.picture.supersampling
    pieces, lock = counter(), Lock()
    failed: list[BaseException] = []

    def work() -> Tally:
        worker = Worker(job, min(side, width) * min(side, height) * samples**2)
        while (number := next(pieces)) < len(firsts) and not failed:
            if cancelled is not None and cancelled():
                failed.append(CancelledError("rendering was cancelled"))
                break
            x, y = firsts[number]
            shape = min(side, width - x), min(side, height - y)
            part = np.zeros((shape[0] * shape[1], 3), np.float32)
            worker.draw((x, y), shape, part)
            picture[y : y + shape[1], x : x + shape[0]] = part.reshape(shape[1], shape[0], 3)
            with lock:
                progress.advance()
        return worker.tally

    total = Tally()
    helpers = min(threads, len(firsts))
    if helpers == 1:
        total.add(work())
    else:
        with ThreadPoolExecutor(helpers) as pool:
            try:
                for done in [pool.submit(work) for _ in range(helpers)]:
                    total.add(done.result())
            except BaseException as problem:  # an interrupt too: the others must not draw on
                failed.append(problem)
                raise
    if failed:
        raise failed[0]
    return total


def _ledger(job: RenderJob, tally: Tally) -> tuple[Skipped, ...]:
    """What was left out, line by line; bounds of a sample's colour, from the lights, materials and reflectivities."""
    skips, pairs = job.skips, tally.pairs
    bounds = Bounds(job.scene)
    lines = [
        Skipped("objects", "exact", "ray-object tests", tally.tests, tally.objects),
        Skipped("background", "exact", "rays", tally.rays, tally.background),
        Skipped("reflectivity", "exact", "reflected rays", tally.reflections, tally.reflectivity),
        Skipped(
            "cutoff", "bounded", "reflected rays", tally.reflections, tally.cutoff, skips.cutoff * bounds.brightest
        ),
        Skipped("shadow_rays", "exact", "shadow rays", tally.shadow_rays, tally.shadow_rays_saved),
    ]
    bounded = {
        "out_of_reach": _beyond_reach(job, bounds, tally) if skips.shading.reach else 0.0,
        "dark_tail": bounds.dark_tail(skips.shading) if skips.shading.dark_tail else 0.0,
    }
    for name, skipped in pairs.items():
        if name != "pairs" and name != "in_shadow":
            kind = "bounded" if name in bounded else "exact"
            lines.append(Skipped(name, kind, "point-light pairs", pairs["pairs"], skipped, bounded.get(name, 0.0)))
    return tuple(lines)


def _beyond_reach(job: RenderJob, bounds: Bounds, tally: Tally) -> float:
    """What lights out of reach would add: what was found out on the way if it was, else what holds anywhere."""
    if not all(shading.boxes for shading in job.shadings):
        return bounds.beyond_reach
    return min(bounds.beyond_reach, tally.loss([m.reflectivity for m in job.scene.materials]))
