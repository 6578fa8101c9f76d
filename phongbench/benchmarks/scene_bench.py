"""Our tracer beside a plain one in NumPy and beside other people's: the same pictures, interleaved in one run.

Who cannot draw all that is wished for is compared with ours drawing just as little. What is compared precisely stands
in each row's note; how alike the pictures are is measured with them.
"""

import math
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from phongbench import __version__
from phongbench.benchmarks import numpy_tracer, skip_gains
from phongbench.benchmarks.scene_peers import PEERS, Entry, Peer, Wishes, agreement
from phongbench.benchmarks.skip_gains import quartiles
from phongbench.compiler.precisions import Array
from phongbench.errors import InputError, MeasurementError
from phongbench.scenes import picture_errors
from phongbench.scenes.render import render
from phongbench.scenes.render_to_file import RenderOptions
from phongbench.scenes.scene import Mesh, Scene
from phongbench.shading.specular_term import EXACT
from phongbench.support.progress import Progress

OURS, PLAIN = "phongbench", "plain NumPy"
_NOTES = {
    OURS: "float32, every core, exact Phong, with the skips that are shipped",
    PLAIN: "float32 arrays as one writes them in NumPy; the same rays and those that our cut-off leaves out",
}
_SILENT = Progress()


@dataclass(eq=False)
class _Entrant:
    """Somebody who draws.

    once       draws, and returns the seconds
    picture    what was drawn last
    rays       traced for it, shadow rays not counted; None where nobody counts them
    distances  None where they are not looked at
    brightest  the largest value that its picture can hold
    """

    name: str
    version: str
    wishes: Wishes
    note: str
    once: Callable[[], float]
    picture: Callable[[], Array]
    rays: Callable[[], int | None] = lambda: None
    distances: Callable[[], Array] | None = None
    brightest: float = math.inf
    seconds: list[float] = field(default_factory=list)


def tracers(
    scene: Scene,
    *,
    rounds: int = 5,
    progress: Progress = _SILENT,
    size: tuple[int, int] | None = None,
    depth: int | None = None,
    shadows: bool | None = None,
    peers: Mapping[str, Entry] = PEERS,
    **_: Any,
) -> tuple[list[dict[str, Any]], list[dict[str, str]]]:
    """A row for each tracer of a scene of spheres and planes under exact Phong, and why peers are absent.

    size, depth, shadows  of the picture; None takes the scene's own
    mpixels_per_second    million pixels, each a ray from the camera, by the least time
    mrays_per_second      million rays, mirrored ones too, shadow rays not; nothing where nobody counts them
    ratio                 median over the rounds of its time over that of ours drawing the same
    largest_difference, pixels_off  against ours, where white is 1: the largest, and the share of pixels that differ by
                          more than a code; where bytes end at 1, ours does too
    surfaces_agree        the share of pixels that show what the plain tracer shows there, by its distance
    """
    own = scene.picture
    depth, shadows = own.depth if depth is None else depth, own.shadows if shadows is None else shadows
    wishes, absent = Wishes(size or own.size, depth, shadows), dict[str, str]()
    with ExitStack() as opened:
        entrants = [_ours(scene, wishes), _plain(scene, wishes)]
        entrants += _peers(scene, wishes, peers, opened, absent, progress)
        drawn = list(dict.fromkeys(e.wishes for e in entrants))
        entrants += [_ours(scene, wished) for wished in drawn if wished != wishes]
        entrants.sort(key=lambda e: (drawn.index(e.wishes), e.name != OURS))  # ours leads those it is compared with
        _run(entrants, rounds, progress, absent)
        truth = numpy_tracer.distances(scene, wishes.size)
        leaders = {e.wishes: e for e in entrants if e.name == OURS}
        rows = [_row(e, leaders[e.wishes], truth) for e in entrants]
    return rows, [{"tracer": name, "why": why} for name, why in absent.items()]


def _ours(scene: Scene, wishes: Wishes) -> _Entrant:
    done: dict[str, Any] = {}

    def once() -> float:
        done["last"] = render(
            scene, specular=EXACT, size=wishes.size, depth=wishes.depth, shadows=wishes.shadows, supersampling=1
        )
        return float(done["last"].seconds["total"])

    once()  # compiles, and warms up
    note = _NOTES[OURS]
    return _Entrant(OURS, __version__, wishes, note, once, lambda: done["last"].picture, lambda: done["last"].rays)


def _plain(scene: Scene, wishes: Wishes) -> _Entrant:
    done: dict[str, Any] = {}

    def once() -> float:
        started = time.perf_counter()
        done["picture"], done["rays"] = numpy_tracer.trace(
            scene, size=wishes.size, depth=wishes.depth, shadows=wishes.shadows, dtype=np.float32
        )
        return time.perf_counter() - started

    return _Entrant(PLAIN, np.__version__, wishes, _NOTES[PLAIN], once, lambda: done["picture"], lambda: done["rays"])


def _peers(
    scene: Scene,
    wishes: Wishes,
    peers: Mapping[str, Entry],
    opened: ExitStack,
    absent: dict[str, str],
    progress: Progress,
) -> Iterator[_Entrant]:
    """Those that can draw here; they are closed with `opened`."""
    progress.stage(f"peers of {scene.name}", len(peers))
    for name, entry in peers.items():
        try:
            peer = Peer(name, entry, scene, entry.able(wishes))
        except MeasurementError as problem:
            absent[name] = problem.what
        else:
            opened.callback(peer.close)
            yield _peer(peer)
        progress.advance()


def _peer(peer: Peer) -> _Entrant:
    return _Entrant(
        peer.name,
        peer.version,
        peer.wishes,
        peer.entry.note,
        peer.draw,
        peer.picture,
        distances=peer.distances,
        brightest=peer.entry.brightest,
    )


def _run(entrants: list[_Entrant], rounds: int, progress: Progress, absent: dict[str, str]) -> None:
    """Everybody draws once in each round, a different one first; who fails leaves."""
    progress.stage("tracers", rounds * len(entrants))
    for number in range(rounds):
        first = number % len(entrants)
        for entrant in entrants[first:] + entrants[:first]:
            try:
                entrant.seconds.append(entrant.once())
            except MeasurementError as problem:
                absent[entrant.name] = problem.what
                entrants.remove(entrant)
            progress.advance()


def _row(e: _Entrant, ours: _Entrant, truth: Array) -> dict[str, Any]:
    picture, best, rays, (width, height) = e.picture(), min(e.seconds), e.rays(), e.wishes.size
    off = np.abs(picture - np.minimum(ours.picture(), e.brightest)).max(axis=2)
    _, ratio, _ = quartiles([b / a for a, b in zip(ours.seconds, e.seconds, strict=True)])
    return {
        "tracer": e.name,
        "version": e.version,
        "draws": str(e.wishes),
        "size": f"{width}x{height}",
        "seconds": round(best, 6),
        "mpixels_per_second": width * height / best / 1e6,
        "rays": rays,
        "mrays_per_second": None if rays is None else rays / best / 1e6,
        "ratio": ratio,
        "largest_difference": float(off.max()),
        "pixels_off": float((off > 1 / 255).mean()),
        "surfaces_agree": None if e.distances is None else agreement(truth, e.distances()),
        "note": e.note,
    }


def measure(options: RenderOptions, progress: Progress = _SILENT) -> dict[str, Any]:
    """What each skip saves in a scene, and our tracer beside a plain one and peers, where those can draw the scene."""
    scene = options.read()
    told: dict[str, Any] = {"scene": scene.name, "notes": list(scene.notes)}
    told["skips"] = skip_gains.skips(scene, progress=progress, **options.arguments(), **_formula(options))
    told["tracers"], told["absent"] = [], []
    if not _beyond_the_plain(scene):
        told["tracers"], told["absent"] = tracers(scene, progress=progress, **options.arguments())
    return told


def judge(options: RenderOptions, progress: Progress = _SILENT) -> dict[str, Any]:
    """Every usual and own formula's picture beside that of exact Phong, or that of the one formula asked for."""
    scene = options.read()
    usual = (*picture_errors.USUAL, *picture_errors.own(options.registry))
    asked = usual if (formula := options.formula) is None else (formula,)
    arguments = {name: value for name, value in options.arguments().items() if name != "model"}
    rows = picture_errors.compare(scene, asked, progress=progress, **arguments)
    drawn = [{k: v for k, v in row.items() if k != "left_out"} for row in rows if not row["left_out"]]
    if options.specular is not None and not drawn:
        raise InputError(rows[0]["left_out"], None, "ask for another formula, or leave --specular away")
    left_out = [{"formula": row["formula"], "why": row["left_out"]} for row in rows if row["left_out"]]
    return {"scene": scene.name, "notes": list(scene.notes), "formulas": drawn, "left_out": left_out}


def _formula(options: RenderOptions) -> dict[str, Any]:
    return {} if options.specular is None else {"specular": options.formula}


def _beyond_the_plain(scene: Scene) -> bool:
    """The plain tracer and the peers know neither meshes nor other formulas."""
    return bool(scene.of(Mesh)) or any(m.specular is not None for m in scene.materials)
