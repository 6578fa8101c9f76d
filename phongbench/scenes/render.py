"""Pictures of scenes: rays traced in tiles on all cores, shaded by the library, and what was left out on the way."""

import os
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
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
#: column and row of a tile's upper left pixel
Tile = tuple[int, int]


@dataclass(frozen=True, eq=False)
class Order:
    """What a picture is drawn by, as plain data that travels to other processes.

    scene  its picture settings are those wanted
    side   pixels along a tile's side
    """

    scene: Scene
    skips: SceneSkips
    specular: Formula
    model: str
    side: int

    @property
    def tiles(self) -> list[Tile]:
        """Row by row."""
        width, height = self.scene.picture.size
        return [(x, y) for y in range(0, height, self.side) for x in range(0, width, self.side)]

    def shape(self, tile: Tile) -> tuple[int, int]:
        """Columns and rows of a tile."""
        width, height = self.scene.picture.size
        return min(self.side, width - tile[0]), min(self.side, height - tile[1])


#: draws tiles elsewhere, given the order, a progress that is told each tile, and threads: tiles and their colours,
#: float32 (rows, columns, 3), in any order, each with what was counted since the one before
TileEngine = Callable[[Order, Progress, int], Iterator[tuple[Sequence[Tile], Sequence[Array], Tally]]]


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
    engine: TileEngine | None = None,
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
    engine     draws the tiles; the picture is the same bits; this process by default
    Raises InputError for a size or depth beyond the limits and for a formula that does not fit a material, naming it;
    CancelledError if the work was given up.
    """
    started = time.perf_counter()
    scene = _with_settings(scene, size=size, depth=depth, supersampling=supersampling, shadows=shadows)
    tally, (width, height) = Tally(), scene.picture.size
    order = Order(scene, skips, specular or EXACT, model, max(1, tile // scene.picture.supersampling))
    painter = Painter(order, registry, tally)
    progress.stage(f"render {scene.name}", len(order.tiles))
    picture, threads = np.zeros((height, width, 3), np.float32), threads or os.cpu_count() or 1
    if engine:
        for tiles, colours, counted in engine(order, progress, threads):
            for (x, y), part in zip(tiles, colours, strict=True):
                picture[y : y + part.shape[0], x : x + part.shape[1]] = part
            tally.add(counted)
    else:
        tally.add(_draw(painter, picture, threads, progress, cancelled))
    seconds = {"total": time.perf_counter() - started, "tracing": tally.tracing, "shading": tally.shading}
    return Rendered(picture, _ledger(painter.job, tally), tally.rays, {k: round(v, 6) for k, v in seconds.items()})


def _with_settings(scene: Scene, **settings: Any) -> Scene:
    """The scene with these picture settings, where they are not None; InputError beyond the limits."""
    picture = replace(scene.picture, **{name: value for name, value in settings.items() if value is not None})
    check_size(*picture.size)
    for name, low, high in (("depth", 0, MOST_DEPTH), ("supersampling", 1, MOST_SUPERSAMPLING)):
        if not low <= (value := getattr(picture, name)) <= high:
            raise InputError(f"{name} = {value} is outside {low} .. {high}", name)
    return replace(scene, picture=picture)


def _job(order: Order, registry: Mapping[str, Approximation], tally: Tally) -> RenderJob:
    """What draws an order's tiles. Errors name the material.

    tally  receives what colours of vertices took
    """
    scene, skips = order.scene, order.skips
    options: dict[str, Any] = {"model": order.model, "registry": registry}
    options |= {"ambient_light": scene.ambient_light, "skips": skips.shading, "normalise": False}
    arrays, viewer, shadowed = geometry(scene), Viewer(position=(0.0, 0.0, 0.0)), scene.picture.shadows
    lights = arrays.space.lights(scene.lights)
    shadings = []
    for material in scene.materials:
        options["specular"] = material.specular or order.specular
        try:
            shadings.append(PreparedShading(material.reflection, lights, viewer, shadowed=shadowed, **options))
        except InputError as problem:
            about = f"{problem.where}: {problem.what}" if problem.where else problem.what
            raise InputError(about, f"materials.{material.name}", problem.fix) from problem
    dark = np.zeros((9, len(arrays.modes)), np.float32)
    view = camera.frame(scene.camera, *scene.picture.size)
    job = RenderJob(scene, arrays, lights, shadings, dark, view, skips)
    return replace(job, vertex=gouraud.colours(job, tally))


class Painter:
    """An order made ready: draws any of its tiles, the same bits in every process."""

    def __init__(self, order: Order, registry: Mapping[str, Approximation], tally: Tally | None = None) -> None:
        self.order, self.job = order, _job(order, registry, tally or Tally())

    def draw(self, tiles: Sequence[Tile]) -> tuple[list[Array], Tally]:
        """The colours of these tiles, each float32 (rows, columns, 3), and what was counted on the way."""
        worker = self.worker()
        return [self.tile(worker, tile) for tile in tiles], worker.tally

    def worker(self) -> Worker:
        """Buffers for one thread."""
        columns, rows = self.order.shape((0, 0))
        return Worker(self.job, columns * rows * self.order.scene.picture.supersampling**2)

    def tile(self, worker: Worker, tile: Tile) -> Array:
        """The colours of a tile, which the worker also counts."""
        columns, rows = self.order.shape(tile)
        part = np.zeros((columns * rows, 3), np.float32)
        worker.draw(tile, (columns, rows), part)
        return part.reshape(rows, columns, 3)


def _draw(
    painter: Painter, picture: Array, threads: int, progress: Progress, cancelled: Callable[[], bool] | None
) -> Tally:
    """Draw all tiles; threads take them in turn. What all of them counted."""
    tiles, pieces, lock = painter.order.tiles, counter(), Lock()
    failed: list[BaseException] = []

    def work() -> Tally:
        worker = painter.worker()
        while (number := next(pieces)) < len(tiles) and not failed:
            if cancelled is not None and cancelled():
                failed.append(CancelledError("rendering was cancelled"))
                break
            x, y = tiles[number]
            part = painter.tile(worker, (x, y))
            picture[y : y + part.shape[0], x : x + part.shape[1]] = part
            with lock:
                progress.advance()
        return worker.tally

    total = Tally()
    helpers = min(threads, len(tiles))
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
