"""Probe `meshes`: what normals interpolated over triangles do to a highlight, against the angle of an edge.

Every formula is given R built from the interpolated normal in both usual ways, or that normal itself with H, raw or
made unit length first. For one exponent all of these see the same points, lights and viewers.
"""

import itertools
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from phongbench.accuracy.accumulators import METRICS, ErrorAccumulator
from phongbench.accuracy.cell_arrays import CellArrays
from phongbench.accuracy.probes.interpolated_normals import NORMALS, PAIRS, Lit, lit, points
from phongbench.accuracy.probes.probe import ProbeContext
from phongbench.accuracy.reductions import measure_cells
from phongbench.compiler.lowering import FLOAT32, FLOAT64
from phongbench.formulas import coordinate_kernels
from phongbench.formulas.exact import of_deficits
from phongbench.formulas.spec import Approximation
from phongbench.inputs import meshes
from phongbench.inputs.meshes import Surface
from phongbench.inputs.obj_files import load
from phongbench.inputs.plan import Cell, Plan
from phongbench.results.schema import MESHES

#: widest edges of the tessellations, in degrees, and the upper ends of the classes of a file's triangles
EDGES = (1.0, 2.0, 3.0, 5.0, 7.5, 10.0, 15.0, 20.0, 30.0)
#: those of a study with fewer samples than this
FEW_EDGES, FEW_SAMPLES = (2.0, 5.0, 10.0, 20.0), 1 << 17
#: a file's triangles beyond the last class, up to where interpolation stops making sense
WIDEST = 90.0
#: exponents outside are left out: too wide to show a mesh, or too narrow to be used on one
ALPHAS = (10.0, 1024.0)
FORMULAS = ("phong", "lyon", "gaussian")
#: points of each part, and of a study with fewer samples
POINTS, FEW_POINTS = 1 << 14, 1 << 13
TRUTHS = ("interpolated", "surface")
_NUMBERS = ("max_abs", "mean_abs", "rms", "codes_8bit", "model_max", "length_max", "nonfinite", "above_one")
#: seconds that a set of pairs takes on one thread beside its cells, and seconds for a value of a cell, both truths
_SET_SECONDS, _VALUE_SECONDS = 1e-3, 1e-8


@dataclass(frozen=True)
class Part:
    """Triangles of one surface that are measured together.

    edge_degrees  the widest angle between the normals at the ends of their edges
    """

    surface: Surface
    triangles: NDArray[np.int64]
    edge_degrees: float


@dataclass(frozen=True)
class _Group:
    """Cells that see the same pairs: those of one exponent in one space.

    cells   positions in the list of all
    arrays  for one truth and for two
    """

    alpha: float
    space: str
    cells: tuple[int, ...]
    arrays: tuple[CellArrays, CellArrays]


def measure(context: ProbeContext) -> dict[str, pd.DataFrame]:
    """The rows of meshes.parquet, in the order of surfaces, edges, exponents, pairs and cells."""
    plan = context.plan
    cells = list(_cells(plan, context))
    if not cells:
        context.note(f"no exponent in {ALPHAS[0]:g} .. {ALPHAS[1]:g} was asked for, so no mesh is measured")
        return {"meshes": MESHES.frame()}
    work = _groups(cells, context)
    tasks = list(_tasks(plan, context.note))
    share, measured = 1 / max(len(tasks), 1), []
    with ThreadPoolExecutor(max_workers=context.jobs) as pool:
        for numbers in pool.map(partial(_measure, work=work, plan=plan), tasks):
            measured.append(numbers)
            context.advance(share)
    return {"meshes": _frame(pd.concat(measured, ignore_index=True), cells, context)}


def seconds(plan: Plan, jobs: int) -> float:
    """What the probe is expected to take."""
    parts = len(_edges(plan)) * len(meshes.TESSELLATIONS) + (len(EDGES) + 1) * len(plan.meshes)
    sets = parts * len(_alphas(plan)) * len(PAIRS) * len(NORMALS)
    cells = len(plan.lambda_forms) * (len(plan.gammas) + 1) + 1
    return sets * (_SET_SECONDS + cells * _samples(plan) * _VALUE_SECONDS) / jobs


def file_parts(surface: Surface, edges: tuple[float, ...] = EDGES) -> tuple[list[Part], int]:
    """The triangles of a mesh in classes by their widest edge, the empty ones left out; and how many have none.

    A class reaches from the end of the one before to its own; the last one, to WIDEST. Where normals at the ends of an
    edge are further apart, no normal between them means anything.
    """
    widest = surface.edge_degrees()
    parts = []
    for low, high in zip((-1.0, *edges), (*edges, WIDEST), strict=True):
        triangles = np.flatnonzero((widest > low) & (widest <= high))
        if len(triangles):
            parts.append(Part(surface, triangles, float(widest[triangles].max())))
    return parts, int((widest > WIDEST).sum())


def _edges(plan: Plan) -> tuple[float, ...]:
    return EDGES if plan.samples >= FEW_SAMPLES else FEW_EDGES


def _alphas(plan: Plan) -> tuple[float, ...]:
    return tuple(a for a in plan.alphas if ALPHAS[0] <= a <= ALPHAS[1])


def _samples(plan: Plan) -> int:
    return min(plan.samples, POINTS if plan.samples >= FEW_SAMPLES else FEW_POINTS)


def _tasks(plan: Plan, note: Callable[[str], None]) -> Iterator[Callable[[], Part]]:
    """What makes each part: tessellations are made when their turn comes, files are read and told about now."""
    for tessellate in meshes.TESSELLATIONS.values():
        for degrees in _edges(plan):
            yield partial(_whole, tessellate, degrees)
    for path in plan.meshes:
        surface = load(path)
        parts, folded = file_parts(surface)
        told = [*surface.remarks, *surface.notes]
        told += [f"left out, edges wider than {WIDEST:g} degrees: {folded}"] if folded else []
        note(f"{surface.name}: {len(surface.faces)} triangles" + "".join(f"; {sentence}" for sentence in told))
        for part in parts:
            yield partial(_same, part)


def _whole(tessellate: Callable[[float], Surface], degrees: float) -> Part:
    surface = tessellate(degrees)
    return Part(surface, np.arange(len(surface.faces)), float(surface.edge_degrees().max()))


def _same(part: Part) -> Part:
    return part


def _cells(plan: Plan, context: ProbeContext) -> Iterator[Cell]:
    """Cells of the formulas that mesh questions are about, in float32 and with the plan's first slope."""
    names, alphas = tuple(n for n in FORMULAS if n in plan.approximations), _alphas(plan)
    narrowed = replace(plan, approximations=names, alphas=alphas, precisions=("float32",), slopes=plan.slopes[:1])
    return (cell for cell in narrowed.cells(context.registry) if cell.gated)


def _groups(cells: list[Cell], context: ProbeContext) -> dict[float, list[_Group]]:
    """The cells of each exponent, by space."""
    together: dict[tuple[float, str], list[int]] = {}
    for position, cell in enumerate(cells):
        together.setdefault((cell.alpha, cell.formula.space), []).append(position)
    groups: dict[float, list[_Group]] = {}
    for (alpha, space), positions in sorted(together.items()):
        chosen: list[tuple[Cell, Approximation]] = [
            (cells[p], context.registry[cells[p].approximation]) for p in positions
        ]
        one, two = (CellArrays.of(chosen, (alpha,), FLOAT32, truths) for truths in (1, 2))
        groups.setdefault(alpha, []).append(_Group(alpha, space, tuple(positions), (one, two)))
    return groups


def _measure(task: Callable[[], Part], work: dict[float, list[_Group]], plan: Plan) -> pd.DataFrame:
    """Every cell over one part: positions and numbers, which `_frame` makes rows of."""
    part = task()
    found = points(part.surface, part.triangles, plan.seed, _samples(plan))
    truths = 1 if found.true is None else 2
    sets: list[tuple[str, str, tuple[int, ...]]] = []
    accumulators: list[ErrorAccumulator] = []
    for alpha, groups in work.items():
        seen = lit(found, alpha)
        for group, pair in itertools.product(groups, PAIRS):
            if (pair == "half") != (group.space == "half"):
                continue
            for normals, errors in _errors(seen, group, pair, truths):
                sets.append((normals, pair, group.cells))
                accumulators.append(errors)
    surface = part.surface
    return _numbers(sets, accumulators, truths).assign(
        mesh=surface.name,
        edge_degrees=part.edge_degrees,
        triangles=len(part.triangles),
        left_out=surface.left_out,
        samples=_samples(plan),
    )


def _numbers(sets: list[tuple[str, str, tuple[int, ...]]], errors: list[ErrorAccumulator], truths: int) -> pd.DataFrame:
    """The rows of all sets of pairs (normals, pair, cells) as one frame: a frame each took longer than measuring."""
    if not sets:
        return pd.DataFrame(columns=["cell", "truth", *_NUMBERS])
    cells, sizes = [c for _, _, each in sets for c in each], [truths * len(each) for _, _, each in sets]
    whole = ErrorAccumulator.stacked(errors)
    columns: dict[str, Any] = {"cell": np.repeat(cells, truths), "truth": np.tile(np.arange(truths), len(cells))}
    columns |= {name: METRICS[name](whole) for name in _NUMBERS}
    columns["normals"], columns["pair"] = (
        _taken(names, np.repeat(np.arange(len(sets)), sizes)) for names in ([s[0] for s in sets], [s[1] for s in sets])
    )
    return pd.DataFrame(columns)


def _errors(seen: Lit, group: _Group, pair: str, truths: int) -> Iterator[tuple[str, ErrorAccumulator]]:
    """The errors with raw normals, then with renormalised ones."""
    count = seen.viewer.shape[1]
    exact = np.empty((1, 2, count))
    unit = coordinate_kernels.coordinates(FLOAT64, *(np.ascontiguousarray(v) for v in seen.true_pair(pair)))
    exact[0, 0] = of_deficits(unit[coordinate_kernels.FORM_ROW["difference"]], group.alpha, pair == "half")
    deficit = seen.surface_deficit(pair)
    if deficit is not None:
        exact[0, 1] = of_deficits(deficit, group.alpha, pair == "half")
    cells = group.arrays[truths - 1]
    for normals in NORMALS:
        a, b = (np.ascontiguousarray(v, np.float32) for v in seen.pair(normals, pair))
        held = coordinate_kernels.coordinates(FLOAT32, a, b)
        given = coordinate_kernels.coordinates(FLOAT64, a.astype(np.float64), b.astype(np.float64))
        errors = ErrorAccumulator(truths * len(group.cells))
        measure_cells(
            cells.rows,
            cells.coefficients,
            cells.coefficients_64,
            cells.tables,
            cells.tables_64,
            a,
            b,
            held,
            given,
            unit,
            exact,
            errors.sums,
            errors.counts,
            errors.bins,
            errors.worst,
            truths,
        )
        errors.samples = count
        yield normals, errors


def _frame(numbers: pd.DataFrame, cells: list[Cell], context: ProbeContext) -> pd.DataFrame:
    """Rows of the table: the key columns of each row's cell beside its numbers."""
    position = numbers["cell"].to_numpy(np.int64)
    settings = [c.setting for c in cells]
    betas = [context.registry[c.approximation].coefficients(c.setting).get("beta", np.nan) for c in cells]
    keys: dict[str, Any] = {
        "approximation": [c.approximation for c in cells],
        "lambda_form": [c.lambda_form for c in cells],
        "space": [s.space for s in settings],
        "beta_policy": [s.slope for s in settings],
        "precision": [c.precision for c in cells],
    }
    frame = numbers.assign(**{name: _taken(values, position) for name, values in keys.items()})
    frame["truth"] = _taken(TRUTHS, numbers["truth"].to_numpy(np.int64))
    frame["alpha"] = np.array([s.alpha for s in settings], np.float64)[position]
    frame["gamma"] = pd.array([s.gamma for s in settings], dtype="Int64")[position]
    frame["beta"] = np.array(betas, np.float64)[position]
    frame["gated"] = np.array([c.gated for c in cells], bool)[position]
    return frame[MESHES.names]


def _taken(values: Any, index: NDArray[np.int64]) -> Any:
    return pd.array(np.array(values, dtype=object), dtype="str").take(index)
