"""Our tracer beside a plain one in NumPy and beside other people's: the same pictures, interleaved in one run.

Who cannot draw all that is requested is compared with ours drawing just as little. What is compared precisely stands
in each row's note; how alike the pictures are is measured with them.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from phongbench import __version__
from phongbench.benchmarks import numpy_tracer, skip_gains
from phongbench.benchmarks.scene_peers import PEERS, Entry, Peer, Wishes, agreement
from phongbench.compiler.precisions import Array
from phongbench.errors import InputError, MeasurementError
from phongbench.formulas.formula import Formula
from phongbench.scenes import picture_errors
from phongbench.scenes.render import render
from phongbench.scenes.render_to_file import RenderOptions
from phongbench.scenes.scene import Mesh, Scene
from phongbench.shading.specular_term import EXACT
from phongbench.support.progress import Progress
from phongbench.timing.interleaved import Times, clocked, interleaved
from phongbench.timing.statistics import LEVEL_TEXT, MIN_ROUNDS

OURS, PLAIN = "phongbench", "plain NumPy"
_NOTES = {
    OURS: "float32, every core, exact Phong, with the skips that are shipped",
    PLAIN: "float32 arrays as one writes them in NumPy; the same rays and those that our cut-off leaves out",
}
_SILENT = Progress()


@dataclass(eq=False)
class _Entrant:
    """Somebody who draws.

    draw       draws once, and returns the seconds
    picture    what was drawn last
    rays       traced for it, shadow rays not counted; None where nobody counts them
    distances  None where they are not looked at
    brightest  the largest value that its picture can hold
    """

    name: str
    version: str
    wishes: Wishes
    note: str
    draw: Callable[[], float]
    picture: Callable[[], Array]
    rays: Callable[[], int | None] = lambda: None
    distances: Callable[[], Array] | None = None
    brightest: float = math.inf


def tracers(
    scene: Scene,
    *,
    rounds: int = MIN_ROUNDS,
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
    rounds, seconds, ratio, ratio_low, ratio_high  its time over that of ours drawing the same, see `Times.row`
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
        progress.stage("tracers", rounds * len(entrants))
        calls = {entrant: entrant.draw for entrant in entrants}
        times = interleaved(calls, rounds=rounds, step=progress.advance, leaves_on=(MeasurementError,))
        absent |= {entrant.name: str(problem.args[0]) for entrant, problem in times.failures.items()}
        truth = numpy_tracer.distances(scene, wishes.size)
        leaders = {e.wishes: e for e in entrants if e.name == OURS}
        rows = [_row(e, leaders[e.wishes], times, truth) for e in entrants if e not in times.failures]
    return rows, [{"tracer": name, "why": why} for name, why in absent.items()]


def _ours(scene: Scene, wishes: Wishes) -> _Entrant:
    done: dict[str, Any] = {}

    def draw() -> float:
        done["last"] = render(
            scene, specular=EXACT, size=wishes.size, depth=wishes.depth, shadows=wishes.shadows, supersampling=1
        )
        return float(done["last"].seconds["total"])

    draw()  # compiles, and warms up
    note = _NOTES[OURS]
    return _Entrant(OURS, __version__, wishes, note, draw, lambda: done["last"].picture, lambda: done["last"].rays)


def _plain(scene: Scene, wishes: Wishes) -> _Entrant:
    done: dict[str, Any] = {}

    def draw() -> None:
        done["picture"], done["rays"] = numpy_tracer.trace(
            scene, size=wishes.size, depth=wishes.depth, shadows=wishes.shadows, dtype=np.float32
        )

    note = _NOTES[PLAIN]
    return _Entrant(PLAIN, np.__version__, wishes, note, clocked(draw), lambda: done["picture"], lambda: done["rays"])


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
            entrant = _Entrant(name, peer.version, peer.wishes, entry.note, peer.draw, peer.picture)
            yield replace(entrant, distances=peer.distances, brightest=entry.brightest)
        progress.advance()


def _row(e: _Entrant, ours: _Entrant, times: Times[_Entrant], truth: Array) -> dict[str, Any]:
    picture, best, rays, (width, height) = e.picture(), times.seconds(e), e.rays(), e.wishes.size
    off = np.abs(picture - np.minimum(ours.picture(), e.brightest)).max(axis=2)
    return {
        "tracer": e.name,
        "version": e.version,
        "draws": str(e.wishes),
        "size": f"{width}x{height}",
        **times.row(e, ours),
        "mpixels_per_second": width * height / best / 1e6,
        "rays": rays,
        "mrays_per_second": None if rays is None else rays / best / 1e6,
        "largest_difference": float(off.max()),
        "pixels_off": float((off > 1 / 255).mean()),
        "surfaces_agree": None if e.distances is None else agreement(truth, e.distances()),
        "note": e.note,
    }


def measure(options: RenderOptions, progress: Progress = _SILENT) -> dict[str, Any]:
    """What each skip saves in a scene, and our tracer beside a plain one and peers, where those can draw the scene."""
    scene, arguments = options.read(), options.arguments()
    skips = skip_gains.skips(scene, progress=progress, **arguments, **_formula(options))
    rows, absent = ([], []) if _beyond_the_plain(scene) else tracers(scene, progress=progress, **arguments)
    result = {"scene": scene.name, "notes": list(scene.notes), "interval": LEVEL_TEXT}
    return result | {"skips": skips, "tracers": rows, "absent": absent}


def judge(request: RenderOptions, progress: Progress = _SILENT) -> dict[str, Any]:
    """Every usual and own formula's picture beside that of exact Phong, or that of the one formula requested.

    A row of `picture_errors.compare` for each, with `Times.row` of its picture, rays included, over exact Phong's.
    """
    scene = request.read()
    usual = (*picture_errors.USUAL, *picture_errors.own(request.registry))
    formulas = usual if (formula := request.formula) is None else (formula,)
    options = {name: value for name, value in request.arguments().items() if name != "model"}
    rows = dict(zip(formulas, picture_errors.compare(scene, formulas, progress=progress, **options), strict=True))
    drawn = [formula for formula, row in rows.items() if not row["left_out"]]
    if request.specular is not None and not drawn:
        raise InputError(rows[formulas[0]]["left_out"], None, "ask for another formula, or leave --specular away")
    times = _picture_times(scene, drawn, options, progress)
    result = [{k: v for k, v in rows[f].items() if k != "left_out"} | times.row(f, None) for f in drawn]
    left_out = [{"formula": row["formula"], "why": row["left_out"]} for row in rows.values() if row["left_out"]]
    notes = list(scene.notes)
    return {"scene": scene.name, "notes": notes, "interval": LEVEL_TEXT, "formulas": result, "left_out": left_out}


def _picture_times(
    scene: Scene, formulas: Sequence[Formula], options: dict[str, Any], progress: Progress
) -> Times[Formula | None]:
    """Times of the pictures of formulas, and of that of exact Phong, which is named None."""

    def drawing(formula: Formula | None) -> Callable[[], float]:
        shown, specular = (scene.exact(), EXACT) if formula is None else (scene, formula)
        return lambda: float(render(shown, specular=specular, **options).seconds["total"])

    progress.stage(f"times of {scene.name}", (1 + len(formulas)) * (1 + MIN_ROUNDS))
    return interleaved({formula: drawing(formula) for formula in (None, *formulas)}, warm=1, step=progress.advance)


def _formula(options: RenderOptions) -> dict[str, Any]:
    return {} if options.specular is None else {"specular": options.formula}


def _beyond_the_plain(scene: Scene) -> bool:
    """The plain tracer knows no meshes and no other formulas, the peers neither reflectances nor ambient of lights."""
    other = any(m.specular is not None or m.reflection.fresnel is not None for m in scene.materials)
    return bool(scene.of(Mesh)) or other or any(max(light.ambient) > 0 for light in scene.lights)
