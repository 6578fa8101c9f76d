"""Normals and heights along a line across a cylinder, from its shading.

Across a cylinder normals lie in the plane of the line and the viewer, so intensity and unit length are two equations:

    (I - ambient) / diffuse = Lx Nx + Lz Nz,    Nx^2 + Nz^2 = 1

With c the left side over the light's length, N = c l + sqrt(1 - c^2) m, l along the light and m across it, to either
side. Which side, a prior says. Heights are the integral of -Nx / Nz. x to the right, z and heights to the viewer;
angles are measured from the viewer's direction, positive towards x.

Source  Boom, Spreeuwers and Veldhuis 2009 (BOOM_2009 of `formulas.citations`, which says how far that was checked)
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd

from phongbench.compiler.precisions import Array
from phongbench.errors import InputError, UnknownNameError
from phongbench.inverse.branches import PRIORS, expected
from phongbench.inverse.line_heights import SURE, heights
from phongbench.inverse.line_model import LineModel

RULES, STARTS = ("simpson", "trapezoid"), ("left", "right", "both")
#: what is known of a sample: fine; darker than the ambient light; at the end of the scale; brighter than this light can
#: make it; seen edge-on or from behind
MARKS = OK, SHADOW, SATURATED, BRIGHT, STEEP = ("ok", "shadow", "saturated", "bright", "steep")
#: a slope beyond this is an edge of the surface
STEEPEST = 100.0
#: standard deviations of noise up to which a sample may be in shadow
_UNLIT = 4.0
#: the least distance of samples, and one over the largest x
CLOSEST = 1e-12
#: the most samples of a line
LONGEST = 1 << 20


#: (name, index) -> what an error calls a sample
Place = Callable[[str, int], str]


@dataclass(frozen=True, eq=False)
class InverseLine:
    """What a line's shading says; missing values are NaN.

    x, intensity      (n,)
    normals, other    (n, 2)  (Nx, Nz) of the chosen branch, and of the other one
    angles, others    (n,)    the same as degrees from the viewer's direction, positive towards x
    height            (n,)    towards the viewer, 0 where heights start
    height_low, height_high   the ends of its nominal 99 % band; equal to it without noise
    marks             (n,)    of MARKS; what is not ok was not used, but for edges that only heights do not cross
    notes             sentences that the user should read
    facts             light_length, and light_degrees: its angle
    """

    x: Array
    intensity: Array
    normals: Array
    other: Array
    height: Array
    height_low: Array
    height_high: Array
    marks: Array
    notes: tuple[str, ...] = ()
    facts: Mapping[str, float] = field(default_factory=dict)

    @property
    def angles(self) -> Array:
        """Of the chosen normals."""
        return np.asarray(np.degrees(np.arctan2(self.normals[:, 0], self.normals[:, 1])))

    @property
    def others(self) -> Array:
        """Of the other branch's."""
        return np.asarray(np.degrees(np.arctan2(self.other[:, 0], self.other[:, 1])))

    @property
    def frame(self) -> pd.DataFrame:
        """A row for each sample."""
        columns: dict[str, Any] = {"x": self.x, "intensity": self.intensity}
        columns |= {"nx": self.normals[:, 0], "nz": self.normals[:, 1], "angle_degrees": self.angles}
        columns |= {"other_nx": self.other[:, 0], "other_nz": self.other[:, 1], "other_degrees": self.others}
        columns |= {name: getattr(self, name) for name in ("height", "height_low", "height_high", "marks")}
        return pd.DataFrame(columns).rename(columns={"marks": "mark"})

    def as_dict(self) -> dict[str, Any]:
        """Plain data for JSON: None for what is missing."""
        names = ("x", "normals", "other", "height", "height_low", "height_high")
        data: dict[str, Any] = {name: _plain(getattr(self, name)) for name in names}
        return data | {"marks": self.marks.tolist(), **self.facts, "notes": list(self.notes)}


def invert_line(
    intensity: Any,
    model: LineModel,
    *,
    x: Any = None,
    prior: str | Sequence[float] | Array = "convex",
    rule: str = "simpson",
    start: str = "left",
    bridge: bool = False,
    place: Place | None = None,
) -> InverseLine:
    """Both normals at every sample, the one that the prior means, and heights.

    intensity  (n,)         in 0 .. 1
    x          (n,) | None  where the samples are, growing; None: 1 apart
    prior      one of PRIORS, or the angles (n,) expected, in degrees
    rule       simpson or trapezoid
    start      where heights are 0: left, right or both; see `heights`
    bridge     whether angles between usable samples stand in for those of unusable ones, on a straight line; else
               heights are told of the longest stretch without such samples only
    place      (name, index) -> what errors call a sample; None: as intensity[7]
    Raises InputError naming the argument or the first bad row, UnknownNameError for names.
    """
    at = place or "{}[{}]".format
    values = _row(intensity, "intensity", at)
    if ((values < 0) | (values > 1)).any():
        bad = int(np.argmax((values < 0) | (values > 1)))
        what = f"an intensity outside 0 .. 1: {values[bad]:g}"
        raise InputError(what, at("intensity", bad), "divide by the largest possible one: --scale, e.g. 255")
    places = np.arange(len(values), dtype=float) if x is None else _row(x, "x", at, len(values))
    if (far := np.abs(places) > 1 / CLOSEST).any():
        raise InputError(f"beyond {1 / CLOSEST:g}", at("x", int(np.argmax(far))), "give x in another unit")
    if (falls := np.diff(places) < CLOSEST).any():
        raise InputError("x does not grow", at("x", int(np.argmax(falls)) + 1), "sort the samples by x, each once")
    for kind, name, known in (("rule", rule, RULES), ("start", start, STARTS)):
        if name not in known:
            raise UnknownNameError(kind, name, known, kind)
    choose = _chooser(prior, len(values), model.spread)
    cosine, marks = _cosines(values, model)
    usable = marks == OK
    normals, other = _both(cosine, model, usable, places, choose)
    steep = usable & (normals[:, 1] * STEEPEST < np.abs(normals[:, 0]))
    marks[steep] = STEEP
    height, band, notes = _heights(places, normals, cosine, model, marks, (rule, start, bridge))
    low, high = height - band, height + band
    facts = {"light_length": model.length, "light_degrees": math.degrees(math.atan2(*model.light))}
    return InverseLine(places, values, normals, other, height, low, high, marks, (*model.notes, *notes), facts)


def _cosines(values: Array, model: LineModel) -> tuple[Array, Array]:
    """Cosines of the angle to the light, and marks."""
    lit = (values - model.ambient) / model.diffuse
    cosine = lit / model.length
    marks = np.full(len(values), OK, dtype=object)
    rounding = 4 * np.finfo(float).eps
    marks[cosine > 1 + rounding] = BRIGHT
    marks[lit * model.diffuse <= _UNLIT * model.noise] = SHADOW
    marks[values >= 1] = SATURATED
    return np.clip(cosine, 0.0, 1.0), marks


def _both(
    cosine: Array, model: LineModel, usable: Array, x: Array, choose: Callable[..., Array]
) -> tuple[Array, Array]:
    """The chosen normals and the others, (n, 2); NaN where a sample is not usable."""
    lx, lz = model.light
    along, across = np.array([lx, lz]) / model.length, np.array([lz, -lx]) / model.length
    sine = np.sqrt((1 - cosine) * (1 + cosine))
    left, right = (cosine[:, None] * along + side * sine[:, None] * across for side in (-1, 1))
    towards, away = math.atan2(lx, lz), np.arccos(cosine)
    chosen = np.zeros(len(x), bool)
    if usable.any():
        chosen[usable] = choose(usable, x, towards - away, towards + away)
    normals, other = (np.where(side[:, None], right, left) for side in (chosen, ~chosen))
    for vectors in (normals, other):
        vectors[~usable] = np.nan
    return normals, other


def _heights(
    x: Array, normals: Array, cosine: Array, model: LineModel, marks: Array, how: tuple[str, str, bool]
) -> tuple[Array, Array, list[str]]:
    """Heights, half the width of their band, and what is to be said of it."""
    rule, start, bridge = how
    height, band = np.full(len(x), np.nan), np.full(len(x), np.nan)
    good = marks == OK
    if not good.any():
        return height, band, ["no sample is usable: there are no heights"]
    angles = np.arctan2(normals[:, 0], normals[:, 1])
    noise = _noise(cosine, angles, model)
    inside = slice(int(np.argmax(good)), len(x) - int(np.argmax(good[::-1])))
    gaps = int((~good[inside]).sum())
    if bridge:
        stretch = inside
        angles = np.interp(x, x[good], angles[good])
        noise = _noise(cosine, angles, model)
        known = good | (marks == BRIGHT)
        noise = {name: np.interp(x, x[known], column[known]) for name, column in noise.items()}
    else:
        stretch = _longest(good)
    slope = -np.tan(angles[stretch])
    part = {name: column[stretch] for name, column in noise.items()}
    height[stretch], band[stretch] = heights(x[stretch], slope, part, rule, start)
    if not gaps:
        return height, band, []
    counted = {mark: int((marks[inside] == mark).sum()) for mark in MARKS[1:]}
    counts = ", ".join(f"{count} {mark}" for mark, count in counted.items() if count)
    done = "bridged by straight lines of the angle" if bridge else "heights are those of the longest stretch without"
    return height, band, [f"samples inside the line that are not usable ({counts}): {done}"]


def _noise(cosine: Array, angles: Array, model: LineModel) -> dict[str, Array]:
    """What noise does to each slope: its spread, and how far its mean may be off, where the slope bends."""
    wide = model.spread
    side = np.sign(angles - math.atan2(*model.light))
    turned = [
        np.arccos(np.clip(cosine + shift, -1.0, 1.0)) - np.arccos(np.clip(cosine, -1.0, 1.0)) for shift in (-wide, wide)
    ]
    low, high = (np.tan(np.clip(angles + side * turn, -_EDGE, _EDGE)) for turn in turned)
    middle = np.tan(np.clip(angles, -_EDGE, _EDGE))
    spread = np.maximum(np.abs(low - middle), np.abs(high - middle))
    bent = np.abs(low + high - 2 * middle) / 2
    # where the surface faces the light, noise is folded: errors there have one sign, and add up
    return {"spread": spread, "bias": np.where(cosine + SURE * wide >= 1, spread, bent)}


#: angle of the steepest slope
_EDGE = math.atan(STEEPEST)


def _longest(good: Array) -> slice:
    """The longest run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], good.astype(np.int8), [0]])))
    runs = edges.reshape(-1, 2)
    first, last = runs[int(np.argmax(runs[:, 1] - runs[:, 0]))]
    return slice(int(first), int(last))


def _row(given: Any, where: str, place: Place, count: int | None = None) -> Array:
    """Finite numbers (n,) as float64."""
    try:
        values = np.array(given, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise InputError("not a list of numbers", where, "give one number for each sample") from None
    if values.ndim != 1 or not 1 <= len(values) <= LONGEST or (count is not None and len(values) != count):
        wanted = f"{count} numbers, one for each sample" if count else f"1 to {LONGEST} numbers in one dimension"
        raise InputError(f"numbers of shape {values.shape}", where, f"give {wanted}")
    if not np.isfinite(values).all():
        raise InputError("not a finite number", place(where, int(np.argmin(np.isfinite(values)))), "leave it out")
    return values


def _chooser(prior: Any, count: int, wide: float) -> Callable[[Array, Array, Array, Array], Array]:
    """The choice among the usable samples."""
    if isinstance(prior, str):
        if prior not in PRIORS:
            raise UnknownNameError("prior", prior, PRIORS, "prior")
        by_name = PRIORS[prior]
        return lambda usable, x, left, right: by_name(x[usable], left[usable], right[usable], wide)
    angles = np.radians(_row(prior, "prior", "{}[{}]".format, count))
    return lambda usable, x, left, right: expected(angles[usable])(x[usable], left[usable], right[usable], wide)


def _plain(array: Array) -> list[Any]:
    plain = array.astype(object)
    plain[np.isnan(array)] = None
    found: list[Any] = plain.tolist()
    return found
