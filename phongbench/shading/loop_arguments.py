"""From lights, a material and its specular term to the numbers and addresses that the loop of shading runs on."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from phongbench.compiler import jit
from phongbench.compiler.lowering import Precision
from phongbench.compiler.precisions import Array
from phongbench.errors import InputError
from phongbench.formulas.spec import MAX_COEFFICIENTS
from phongbench.shading import tiles as at
from phongbench.shading.light_loops import facing_loop, glow_loop, incidence_loop
from phongbench.shading.lighting import BLACK, CONSTANT, Light, Material, Skips, Viewer
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
    """What there is to do for these lights; `ambient` is ka ia. A light whose terms are all 0 is left out here.

    The ambient term of a light in a direction is the same everywhere: it is added to ka ia.
    """
    precision = term.precision
    _check_places(lights, viewer, precision)
    view_planes = viewer.position is not None or not skips.constant_directions
    numbers = _numbers(lights, material, viewer, term, skips)
    plan = _plan(numbers, lights, term, skips, shadowed=shadowed, view_planes=view_planes)
    _plan_glows(plan, numbers, lights, precision)
    used = plan[:, [at.ADDS_DIFFUSE, at.ADDS_SPECULAR, at.GLOWS]].any(axis=1) | (not skips.zero_colours)
    numbers, plan = numbers[used], plan[used]
    fresnel = np.zeros(3 * MAX_COEFFICIENTS, precision.carrier)
    highlights = bool(plan[:, at.HAS_LOOP].any())
    options = _options(numbers, viewer, skips, precision)
    options[at.NEEDS_VIEW] = highlights and view_planes
    options[at.FORMULA_LOOP] = term.kernel.address
    options[at.KEEP_LENGTH] = term.keeps_view and material.fresnel is None
    if material.fresnel is not None and highlights:
        fresnel = material.fresnel.rows(precision).reshape(-1)
        options[[at.HAS_FRESNEL, at.FRESNEL_LOOP]] = True, jit.address(material.fresnel.loop(precision))
        _plan_incidence(plan, numbers, view_planes, skips, precision)
    everywhere = [*ambient]
    for light in lights:
        if light.position is None:
            everywhere = [a + k * i for a, k, i in zip(everywhere, material.ambient, light.ambient, strict=True)]
    with np.errstate(over="ignore"):  # light beyond the range of float32 is infinite, as the loops make it
        constants = np.array([*at.bounds(precision), *everywhere], precision.carrier)
    spread = np.ascontiguousarray(numbers.T).reshape(-1)
    arrays = (numbers, spread, plan, options, constants, term.kernel.coefficients, term.kernel.table, fresnel)
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


def _plan_glows(plan: Array, numbers: Array, lights: Sequence[Light], precision: Precision) -> None:
    """Which lights add an ambient term point by point, and the loops that do: those at positions, unless it is 0."""
    plan[:, at.GLOWS] = numbers[:, at.GLOW : at.GLOW + 3].any(axis=1)
    for row, light in zip(plan, lights, strict=True):
        if row[at.GLOWS]:
            row[at.GLOW_LOOP] = jit.address(glow_loop(_fades(light), precision))


def _plan_incidence(plan: Array, numbers: Array, view_planes: bool, skips: Skips, precision: Precision) -> None:
    """The loop over incidence of each light that has one over coordinates: its direction lies where that finds it."""
    for row, placed in zip(plan, numbers[:, at.PLACED] > 0, strict=True):
        if row[at.HAS_LOOP]:
            planes = bool(placed) or not skips.constant_directions
            row[at.INCIDENCE_LOOP] = jit.address(incidence_loop(planes, view_planes, precision))


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
    return "fading" if _fades(light) else "point"


def _fades(light: Light) -> bool:
    """Whether the light of a lamp depends on its distance."""
    return tuple(light.attenuation)[1:] != CONSTANT[1:]


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
            *(BLACK if light.position is None else light.ambient),
        )
        for light in lights
    ]
    numbers = np.array(rows, np.float64).reshape(-1, at.NUMBERS)
    numbers[:, at.DIFFUSE : at.DIFFUSE + 3] *= material.diffuse
    numbers[:, at.SPECULAR : at.SPECULAR + 3] *= material.specular
    numbers[:, at.GLOW : at.GLOW + 3] *= material.ambient
    for colours in (slice(at.DIFFUSE, at.SPECULAR + 3), slice(at.GLOW, at.GLOW + 3)):
        numbers[:, colours] = np.minimum(numbers[:, colours], most)
    with np.errstate(over="ignore", under="ignore"):
        return numbers.astype(carrier)
