"""Random lines and pictures for the inverse: none crashes, and what cannot be is refused by its row, pixel or light."""

import csv
import io
import json
import math
import warnings
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from phongbench.errors import InputError
from phongbench.formulas.formula import Formula
from phongbench.inverse import line, line_files, photometric, shape_model, surface_heights
from phongbench.inverse.branches import PRIORS
from phongbench.inverse.line_model import LineModel
from phongbench.inverse.surface_model import PhotometricLight, SurfaceModel

#: numbers that are no intensity
BAD = (math.nan, math.inf, -math.inf, -0.25, 1.5, 1e308)
#: numbers at the ends of what is one
EDGES = (0.0, 1.0, 5e-324, 1e-300, 0.5, math.nextafter(1.0, 0.0))
FORMULAS = tuple(map(Formula.parse, ("phong", "lyon:dot:8", "blinn")))
_TOLD = 20


@dataclass
class Found:
    """What came of the cases: how many of each kind were answered and refused, and faults in words."""

    counts: Counter[str] = field(default_factory=Counter)
    faults: list[str] = field(default_factory=list)

    def as_dict(self) -> dict[str, Any]:
        """Plain data."""
        return {"cases": self.counts.total(), **dict(sorted(self.counts.items())), "faults": self.faults[:_TOLD]}


@dataclass(frozen=True)
class Case:
    """Something that is asked: what does it, and the place that its refusal must name; None where there is an answer.

    any_place  whether it may be refused for a reason of its own, by any place
    """

    kind: str
    ask: Callable[[], None]
    place: str | None = None
    any_place: bool = False


def soak(count: int, seed: int, folder: Path, advance: Callable[[int], None] = lambda n: None) -> Found:
    """Ask `count` random cases; files are put into `folder`. Equal seeds ask the same."""
    found, rng = Found(), np.random.default_rng(seed)
    makers = (a_line, a_line_file, a_line_request, a_picture_stack, a_shape, a_surface)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for number in range(count):
            case = makers[int(rng.integers(len(makers)))](rng, folder)
            outcome, fault = judged(case)
            found.counts[f"{case.kind}, {outcome}"] += 1
            found.faults += [f"case {number}, {case.kind}: {fault}"] if fault else []
            advance(1)
    return found


def judged(case: Case) -> tuple[str, str | None]:
    """How a case ended, and what is wrong with that."""
    try:
        case.ask()
    except InputError as problem:
        if case.place is None and not case.any_place:
            return "refused", f"what can be was refused: {problem}"
        if not problem.where:
            return "refused", f"the refusal names no place: {problem}"
        wrong = case.place is not None and case.place not in str(problem)
        return "refused", f"the refusal does not name {case.place}: {problem}" if wrong else None
    except Exception as problem:  # noqa: BLE001 - finding out what is raised is the purpose
        return "crashed", f"{type(problem).__name__}: {problem}"
    return "answered", None if case.place is None else f"what cannot be at {case.place} was answered"


def a_line(rng: np.random.Generator, folder: Path) -> Case:
    """A line, one sample of which may be impossible."""
    values, x = _samples(rng), None
    if rng.random() < 0.5:
        x = np.cumsum(rng.choice([1e-3, 0.5, 1.0, 1e6], len(values))) * float(rng.choice([1e-8, 1.0, 100.0]))
    place = None
    if rng.random() < 0.3:
        bad = int(rng.integers(len(values)))
        if x is not None and rng.random() < 0.5 and bad:
            x[bad], place = rng.choice([math.nan, math.inf, x[bad - 1], -1e300]), f"x[{bad}]"
        else:
            values[bad], place = rng.choice(BAD), f"intensity[{bad}]"
    options, model = _options(rng, len(values)), _line_model(rng)
    return Case("line", lambda: _check_line(line.invert_line(values, model, x=x, **options)), place)


def a_line_file(rng: np.random.Generator, folder: Path) -> Case:
    """A line as CSV, one row of which may be broken."""
    values, text, path = _samples(rng), io.StringIO(), folder / "line.csv"
    rows: list[list[Any]] = [[value] for value in values.tolist()]
    if rng.random() < 0.5:
        rows = [[k, *row] for k, row in enumerate(rows)]
    headed, place = bool(rng.integers(2)), None
    header = [["x", "intensity"][-len(rows[0]) :]] if headed else []
    if rng.random() < 0.4 and len(rows) > 1:
        bad = int(rng.integers(1, len(rows)))
        start = rows[bad][:-1]
        rows[bad] = [[*rows[bad], "1"], [*start, ""], [*start, "bright"], [*start, "nan"]][int(rng.integers(4))]
        place = f"{path}:{bad + 1 + headed}"
    rows = header + rows
    csv.writer(text).writerows(rows)
    data = text.getvalue().encode()
    odd = rng.random() < 0.2
    if odd:
        at = int(rng.integers(len(data)))
        data = data[:at] + bytes(rng.integers(0, 256, int(rng.integers(1, 9)), dtype=np.uint8)) + data[at:]
    path.write_bytes(data)
    model = _line_model(rng)
    return Case("line file", lambda: _check_line(line_files.invert_file(path, model)), None if odd else place, odd)


def a_line_request(rng: np.random.Generator, folder: Path) -> Case:
    """A request, one member of which may be of another kind."""
    document: dict[str, Any] = {"intensity": _samples(rng).tolist(), "ambient": 0.1, "diffuse": 0.7, "light": [0.2, 1]}
    document |= {"prior": str(rng.choice([*PRIORS])), "noise": float(rng.choice([0.0, 0.01]))}
    place = None
    if rng.random() < 0.6:
        place = str(rng.choice([*document, "colour"]))
        document[place] = [None, "bright", [], {}, math.nan, -1.0, [math.nan, 1.0], 1e400, True][int(rng.integers(9))]

    def ask() -> None:
        _check_line(line_files.line_request(document)[1]())

    return Case("line request", ask, place if place in ("colour", "light", "prior") else None, place is not None)


def a_picture_stack(rng: np.random.Generator, folder: Path) -> Case:
    """Pictures under lights, one pixel or light of which may be impossible."""
    count, height, width = (int(rng.integers(low, 6)) for low in (3, 1, 1))
    pictures = rng.choice([*EDGES, 0.3, 0.7], (count, height, width)) * float(rng.choice([1.0, 1e-9, 1e6]))
    turns = 2 * math.pi * np.arange(count) / count
    towards = [[0.5 * math.cos(t), 0.5 * math.sin(t), 1.0] for t in turns.tolist()]
    place, fault = None, float(rng.random())
    if fault < 0.2:
        k, row, column = (int(rng.integers(size)) for size in pictures.shape)
        pictures[k, row, column], place = (
            rng.choice([math.nan, math.inf, 1e300]),
            f"pictures[{k}]: column {column} of row {row}",
        )
    elif fault < 0.4:
        k = int(rng.integers(count))
        wrong = [[0.0, 0.0, 0.0], [0.0, 0.0, -1.0], [math.nan, 0.0, 1.0], [1.0, 2.0], towards[k - 1]]
        towards[k], place = wrong[int(rng.integers(5))], "lights["
    model = _surface_model(rng)
    mask = rng.random((height, width)) < 0.8 if rng.random() < 0.5 else None
    options: dict[str, Any] = {"albedo": bool(rng.integers(2)), "gloss": bool(rng.integers(2)), "mask": mask}
    parallel = place == "lights[" and count > 3 and towards[k] == towards[k - 1]

    def ask() -> None:
        lights = [PhotometricLight.of(one, where=f"lights[{k}]") for k, one in enumerate(towards)]
        found = photometric.invert_pictures(pictures, lights, model, **options)
        _check_normals(found.normals)
        _check_heights(found.heights())

    return Case("pictures", ask, None if parallel else place, parallel)


def a_shape(rng: np.random.Generator, folder: Path) -> Case:
    """A picture for a shape of a small population, one pixel or map of which may be impossible."""
    maps = shape_model.synthetic_heads(4, int(rng.integers(4, 9)), int(rng.integers(1 << 30)))
    picture, place, fault = rng.random(maps.shape[1:]), None, float(rng.random())
    row, column = (int(rng.integers(size)) for size in picture.shape)
    if fault < 0.2:
        picture[row, column], place = rng.choice([math.nan, math.inf]), f"column {column} of row {row}"
    elif fault < 0.4:
        k = int(rng.integers(len(maps)))
        maps[k, row, column], place = rng.choice([math.nan, math.inf]), f"depths[{k}]"
    light, model = PhotometricLight.of(rng.normal(size=3) * [1, 1, 0] + [0, 0, 1]), _surface_model(rng)
    noise = float(rng.choice([1e-9, 0.01, 1e3]))

    def ask() -> None:
        found = shape_model.fit(picture, shape_model.learn(maps, int(rng.integers(1, 4))), light, model, noise)
        _require(bool(np.isfinite(found.heights).all()), "a height is not finite")

    return Case("shape", ask, place)


def a_surface(rng: np.random.Generator, folder: Path) -> Case:
    """Normals of any kind, unknown and edge-on ones among them."""
    height, width = (int(rng.integers(1, 7)) for _ in range(2))
    normals = rng.choice([0.0, 1.0, -1.0, 1e-300, 0.5, math.nan, math.inf], (height, width, 3))
    return Case("surface", lambda: _check_heights(surface_heights.integrate(normals)))


def _samples(rng: np.random.Generator) -> Any:
    count = int(rng.choice([1, 2, 3, 4, 5, 8, 16, 40]))
    kinds: tuple[Callable[[], Any], ...] = (
        lambda: rng.choice(EDGES, count),
        lambda: rng.random(count),
        lambda: np.clip(0.8 + rng.normal(0, 0.02, count), 0, 1),
        lambda: 0.1 + 0.7 * np.abs(np.sin(float(rng.uniform(0.05, 1.5)) * np.arange(count))),
        lambda: np.full(count, float(rng.choice(EDGES))),
    )
    return np.asarray(kinds[int(rng.integers(len(kinds)))](), np.float64)


def _options(rng: np.random.Generator, count: int) -> dict[str, Any]:
    prior: Any = str(rng.choice([*PRIORS])) if rng.random() < 0.8 else rng.uniform(-1e3, 1e3, count)
    rule, start = str(rng.choice(line.RULES)), str(rng.choice(line.STARTS))
    return {"prior": prior, "rule": rule, "start": start, "bridge": bool(rng.integers(2))}


def _line_model(rng: np.random.Generator) -> LineModel:
    x, z = float(rng.choice([0.0, 0.2, -1.0, 1e9])), float(rng.choice([0.0, 1e-9, 0.9]))
    light = (x, z) if math.hypot(x, z) >= 1e-9 else (0.0, 1.0)
    ambient, diffuse = float(rng.choice([0.0, 0.1, 1.0, 1e9])), float(rng.choice([1e-9, 0.7, 1.0, 1e9]))
    return LineModel(ambient, diffuse, light, float(rng.choice([0.0, 1e-12, 0.004, 0.3, 1e9])))


def _surface_model(rng: np.random.Generator) -> SurfaceModel:
    ambient, diffuse = float(rng.choice([0.0, 0.1, 1e6])), float(rng.choice([1e-6, 0.7, 1e6]))
    specular, formula = float(rng.choice([0.0, 0.5, 1e6])), FORMULAS[int(rng.integers(len(FORMULAS)))]
    return SurfaceModel(ambient, diffuse, specular, float(rng.choice([8.0, 50.0])), formula)


def _check_line(found: line.InverseLine) -> None:
    known = np.isfinite(found.height)
    _require(bool((found.height_low[known] <= found.height_high[known]).all()), "a band that is upside down")
    _require(bool(np.isnan(found.normals[~np.isin(found.marks, (line.OK, line.STEEP))]).all()), "an unusable normal")
    for branch in (found.normals, found.other):
        lengths = np.hypot(*branch.T)
        _require(bool((np.abs(lengths[np.isfinite(lengths)] - 1) < 1e-9).all()), "a normal that is not unit")
    json.dumps(found.as_dict(), allow_nan=False)


def _check_normals(normals: Any) -> None:
    lengths = np.linalg.norm(normals, axis=-1)
    _require(bool((np.isnan(lengths) | (np.abs(lengths - 1) < 1e-9)).all()), "a normal that is not unit")


def _check_heights(heights: Any) -> None:
    _require(not np.isinf(heights).any(), "an infinite height")


def _require(holds: bool, what: str) -> None:
    if not holds:
        raise AssertionError(what)
