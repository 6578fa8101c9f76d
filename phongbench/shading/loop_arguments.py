"""From lights, a material and its specular term to the numbers and addresses that the loop of shading runs on."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from phongbench.compiler import jit
from phongbench.compiler.lowering import Precision
from phongbench.compiler.precisions import Array
from phongbench.errors import InputError
from phongbench.shading import tiles as at
from phongbench.shading.light_loops import facing_loop
from phongbench.shading.lighting import CONSTANT, Light, Material, Skips, Viewer
from phongbench.shading.reach_bounds import reach_loop
from phongbench.shading.specular_term import SpecularTerm

#: from how many lights on the boxes of a tile are worth making
_MANY = 4


@dataclass(frozen=True, eq=False)
class LoopArguments:
    """What the loop is given besides points, and what was left out before it begins.

    arrays    the `prepared` of `tile_loop.shade_tiles`
    left_out  lights whose terms are all 0
    constant  directions that are the same everywhere: of lights, and of the viewer
    """

    arrays: tuple[Array, ...]
    left_out: int
    constant: int


def loop_arguments(
    material: Material,
    lights: Sequence[Light],
    viewer: Viewer,
    term: SpecularTerm,
    skips: Skips,
    *,
    ambient: Sequence[float],
    shadowed: bool,
) -> LoopArguments:
    """What there is to do for these lights; `ambient` is ka ia. A light whose terms are all 0 is left out here."""
    precision = term.precision
    _check_places(lights, viewer, precision)
    view_planes = viewer.position is not None or not skips.constant_directions
    numbers = _numbers(lights, material, viewer, term, skips)
    plan = _plan(numbers, lights, term, skips, shadowed=shadowed, view_planes=view_planes)
    used = plan[:, [at.ADDS_DIFFUSE, at.ADDS_SPECULAR]].any(axis=1) | (not skips.zero_colours)
    numbers, plan = numbers[used], plan[used]
    highlights = bool(plan[:, at.HAS_LOOP].any())
    options = _options(numbers, viewer, skips, precision)
    options[at.NEEDS_VIEW] = highlights and view_planes
    options[at.FORMULA_LOOP] = term.kernel.address
    with np.errstate(over="ignore"):  # light beyond the range of float32 is infinite, as the loops make it
        constants = np.array([*at.bounds(precision), *ambient], precision.carrier)
    spread = np.ascontiguousarray(numbers.T).reshape(-1)
    arrays = (numbers, spread, plan, options, constants, term.kernel.coefficients, term.kernel.table)
    constant = sum(light.position is None for light in lights) + (highlights and not view_planes)
    return LoopArguments(arrays, int((~used).sum()), constant if skips.constant_directions else 0)


def _check_places(lights: Sequence[Light], viewer: Viewer, precision: Precision) -> None:
    """Raise InputError for a light or viewer so far away that its square is not finite."""
    limit = float(at.bounds(precision)[at.LARGEST])
    places = [
        ("viewer.position", viewer.position),
        *((f"lights[{k}].position", x.position) for k, x in enumerate(lights)),
    ]
    for where, position in places:
        if position is not None and max(map(abs, position)) > limit:
            what = f"beyond {limit:g}, where squares cannot be computed"
            raise InputError(what, where, "come nearer, or use float64")


def _plan(
    numbers: Array, lights: Sequence[Light], term: SpecularTerm, skips: Skips, *, shadowed: bool, view_planes: bool
) -> Array:
    """What is to be done for each light, int64 (lights, at.PLAN), as tiles.py lists it."""
    plan = np.zeros((len(lights), at.PLAN), np.int64)
    plan[:, at.ADDS_DIFFUSE] = numbers[:, at.DIFFUSE : at.DIFFUSE + 3].any(axis=1)
    plan[:, at.ADDS_SPECULAR] = numbers[:, at.SPECULAR : at.SPECULAR + 3].any(axis=1)
    plan[:, at.EVALUATES] = plan[:, at.ADDS_SPECULAR] | (not skips.zero_colours)
    plan[:, at.HAS_LOOP] = plan[:, at.EVALUATES] | (not skips.unused_vectors)
    plan[:, at.SEEN_ROW] = np.arange(len(lights)) if shadowed else -1
    kinds = [_kind(light, skips) for light in lights]
    facing = {kind: jit.address(facing_loop(kind, shadowed, term.precision)) for kind in set(kinds)}
    plan[:, at.FACING_LOOP] = [facing[kind] for kind in kinds]
    if plan[:, at.HAS_LOOP].any():
        loops = {kind: term.coordinates(kind != "directional", view_planes) for kind in facing}
        plan[:, at.COORDINATE_LOOP] = [loops[kind] for kind in kinds]
    return plan


def _options(numbers: Array, viewer: Viewer, skips: Skips, precision: Precision) -> Array:
    """The options that do not depend on the specular term."""
    options = np.zeros(at.OPTIONS, np.int64)
    options[at.EYE_PLACED] = viewer.position is not None
    options[at.BOXES] = skips.lights_behind and len(numbers) >= _MANY
    if options[at.BOXES] and np.isfinite(numbers[:, at.REACH]).any():
        options[at.LIMITED], options[at.REACH_LOOP] = 1, jit.address(reach_loop(precision))
    options[at.KEEP_BEHIND], options[at.KEEP_UNLIT] = not skips.lights_behind, not skips.beyond_support
    return options


def _kind(light: Light, skips: Skips) -> str:
    if light.position is None:
        return "directional" if skips.constant_directions else "spread"
    return "point" if tuple(light.attenuation)[1:] == CONSTANT[1:] else "fading"


def _numbers(lights: Sequence[Light], material: Material, viewer: Viewer, term: SpecularTerm, skips: Skips) -> Array:
    """A row of numbers for each light, (lights, at.NUMBERS), as tiles.py lists them."""
    eye = viewer.direction if viewer.position is None else viewer.position
    carrier = term.precision.carrier
    most = float(np.finfo(carrier).max)
    rows = [
        (
            *(light.direction or light.position or ()),
            *(light.attenuation if _kind(light, skips) == "fading" else (min(1 / light.attenuation[0], most), 0, 0)),
            math.inf if light.reach is None or not skips.reach else min(light.reach, 1e150) ** 2,
            *light.diffuse,
            *light.specular,
            *(eye or ()),
            term.dark,
            term.tail,
            light.position is not None,
        )
        for light in lights
    ]
    numbers = np.array(rows, np.float64).reshape(-1, at.NUMBERS)
    numbers[:, at.DIFFUSE : at.DIFFUSE + 3] *= material.diffuse
    numbers[:, at.SPECULAR : at.SPECULAR + 3] *= material.specular
    colours = slice(at.DIFFUSE, at.SPECULAR + 3)
    numbers[:, colours] = np.minimum(numbers[:, colours], most)
    with np.errstate(over="ignore", under="ignore"):
        return numbers.astype(carrier)
