"""From materials, lights and a formula to the numbers and addresses that the loop of shading runs on."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from phongbench.compiler import jit
from phongbench.compiler.lowering import Precision
from phongbench.compiler.precisions import Array
from phongbench.errors import InputError
from phongbench.formulas import coordinate_kernels
from phongbench.formulas.formula import Specular
from phongbench.formulas.kernel import coefficient_row, known_values, table_row
from phongbench.formulas.kernel import limit as limit_
from phongbench.formulas.registry import guarded
from phongbench.formulas.spec import Approximation, Setting
from phongbench.shading import tiles as at
from phongbench.shading.light_loops import coordinate_loop, facing_loop
from phongbench.shading.lighting import CONSTANT, Light, Material, Skips, Viewer
from phongbench.shading.reach_bounds import reach_loop

#: from how many lights on the boxes of a tile are worth making
_MANY = 4


@dataclass(frozen=True)
class Formula:
    """The specular term: a compiled loop, on which pair and in which coordinate, and where it is dark.

    dark  the coordinate beyond which a block is left out; tail the cosine below which exact Phong counts as dark
    """

    spec: Approximation
    setting: Setting
    form: str
    space: str
    precision: Precision
    dark: float
    tail: float

    @property
    def ends(self) -> str:
        """What the ledger calls a block that lies in the dark."""
        return "dark_tail" if self.tail > 0 else "beyond_support"

    @lru_cache(maxsize=64)  # noqa: B019  frozen and few; a table takes longer to make than a small request to shade
    def arguments(self) -> tuple[int, Array, Array]:
        """Address of the loop, coefficients, table."""
        spec, setting, precision = self.spec, self.setting, self.precision
        with guarded(spec):
            kernel = coordinate_kernels.values_kernel(spec, precision, known_values(spec, setting))
            row, table = coefficient_row(spec, setting, precision), table_row(spec, setting, precision)
            return jit.address(kernel), row, table

    def loop(self, light_planes: bool, view_planes: bool) -> int:
        """Address of the loop that finds the coordinate."""
        kind = (self.space, self.form, light_planes, view_planes, self.tail > 0)
        return jit.address(coordinate_loop(*kind, self.precision))


def formula_of(
    material: Material, model: str, specular: Specular, registry: Any, precision: Precision, skips: Skips
) -> Formula:
    """What stands for the specular term, resolved. UnknownNameError or InputError names the field."""
    spec, form, setting, space = specular.resolved(model, material.highlight_exponent, registry)
    exact = spec.kind == "exact" and form == "none"
    dark = -np.inf if form == "none" else np.inf
    if skips.beyond_support and (exact or spec.cutoff is not None):
        with guarded(spec):
            dark = limit_(spec, setting, precision)
    tail = 0.0
    if skips.dark_tail and exact:
        least = 4 * float(np.finfo(precision.carrier).eps) if skips.tail is None else skips.tail
        tail = least ** (1 / setting.alpha)
        dark = max(dark, tail)
    return Formula(spec, setting, form, space, precision, dark, tail)


@dataclass(frozen=True)
class Job:
    """What the loop is given besides points: see `shade_loop.shade_tiles`; and what was left out before it begins."""

    formula: Formula
    lights: Array
    plan: NDArray[np.int64]
    options: NDArray[np.int64]
    left_out: int
    constant: int


def job_of(
    formula: Formula,
    material: Material,
    lights: Sequence[Light],
    viewer: Viewer,
    skips: Skips,
    precision: Precision,
    *,
    shadowed: bool,
) -> Job:
    """What there is to do for these lights. A light whose terms are all 0 is left out here."""
    limit = float(at.bounds(precision)[at.LARGEST])
    _within_limit(viewer.position, "viewer.position", limit)
    for k, light in enumerate(lights):
        _within_limit(light.position, f"lights[{k}].position", limit)
    view_planes = viewer.position is not None or not skips.constant_directions
    table = _numbers(lights, material, viewer, formula, skips, precision)
    adds = np.stack([table[:, first : first + 3].any(axis=1) for first in (at.DIFFUSE, at.SPECULAR)], axis=1)
    kept = adds.any(axis=1) | (not skips.zero_colours)
    plan = np.zeros((len(lights), at.PLAN), np.int64)
    plan[:, at.ADDS_DIFFUSE], plan[:, at.ADDS_SPECULAR] = adds.T
    plan[:, at.EVALUATES] = adds[:, 1] | (not skips.zero_colours)
    plan[:, at.HAS_LOOP] = plan[:, at.EVALUATES] | (not skips.unused_vectors)
    plan[:, at.SEEN_ROW] = np.arange(len(lights)) if shadowed else -1
    kinds = [_kind(light, skips) for light in lights]
    facing = {kind: jit.address(facing_loop(kind, shadowed, precision)) for kind in set(kinds)}
    plan[:, at.FACING_LOOP] = [facing[kind] for kind in kinds]
    asks = bool(plan[kept, at.HAS_LOOP].any())
    if asks:
        loops = {kind: formula.loop(kind != "directional", view_planes) for kind in facing}
        plan[:, at.COORDINATE_LOOP] = [loops[kind] for kind in kinds]
    options = np.zeros(at.OPTIONS, np.int64)
    options[at.EYE_PLACED] = viewer.position is not None
    options[at.NEEDS_VIEW] = asks and view_planes
    options[at.BOXES] = skips.lights_behind and kept.sum() >= _MANY
    if options[at.BOXES] and np.isfinite(table[kept, at.REACH]).any():
        options[at.LIMITED], options[at.REACH_LOOP] = 1, jit.address(reach_loop(precision))
    options[at.KEEP_BEHIND], options[at.KEEP_UNLIT] = not skips.lights_behind, not skips.beyond_support
    constant = sum(light.position is None for light in lights) + (asks and not view_planes)
    return Job(
        formula, table[kept], plan[kept], options, int((~kept).sum()), constant if skips.constant_directions else 0
    )


def _within_limit(position: Sequence[float] | None, where: str, limit: float) -> None:
    if position is not None and max(map(abs, position)) > limit:
        raise InputError(f"beyond {limit:g}, where squares cannot be computed", where, "come nearer, or use float64")


def _kind(light: Light, skips: Skips) -> str:
    if light.position is None:
        return "directional" if skips.constant_directions else "spread"
    return "point" if tuple(light.attenuation)[1:] == CONSTANT[1:] else "fading"


def _numbers(
    lights: Sequence[Light], material: Material, viewer: Viewer, formula: Formula, skips: Skips, precision: Precision
) -> Array:
    """A row of numbers for each light, as tiles.py lists them."""
    eye = viewer.direction if viewer.position is None else viewer.position
    most = float(np.finfo(precision.carrier).max)
    rows = [
        (
            *(light.direction or light.position or ()),
            *(light.attenuation if _kind(light, skips) == "fading" else (min(1 / light.attenuation[0], most), 0, 0)),
            math.inf if light.reach is None or not skips.reach else min(light.reach, 1e150) ** 2,
            *light.diffuse,
            *light.specular,
            *(eye or ()),
            formula.dark,
            formula.tail,
            light.position is not None,
        )
        for light in lights
    ]
    table = np.array(rows, np.float64).reshape(-1, at.NUMBERS)
    table[:, at.DIFFUSE : at.DIFFUSE + 3] *= material.diffuse
    table[:, at.SPECULAR : at.SPECULAR + 3] *= material.specular
    colours = slice(at.DIFFUSE, at.SPECULAR + 3)
    table[:, colours] = np.minimum(table[:, colours], most)
    with np.errstate(over="ignore", under="ignore"):
        return table.astype(precision.carrier)
