"""Probe `meshes`: what normals interpolated over triangles do to a highlight, against the angle of an edge.

Every formula is given R built from the interpolated normal in both usual ways, or that normal itself with H, raw or
made unit length first. For one exponent all of these see the same points, lights and viewers.
"""

import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from phongbench.accuracy import tables
from phongbench.accuracy.accumulators import METRICS, ErrorAccumulator
from phongbench.accuracy.cell_arrays import CellArrays
from phongbench.accuracy.coordinates import Piece
from phongbench.accuracy.probes.interpolated_normals import NORMALS, PAIRS, Lit, lit, points
from phongbench.accuracy.probes.probe import ProbeContext
from phongbench.accuracy.sweep import Sweep
from phongbench.compiler.lowering import FLOAT32, FLOAT64
from phongbench.formulas.coordinate_kernels import FORM_ROW, coordinates
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
_SET_SECONDS, _VALUE_SECONDS = 5e-4, 5e-9


@dataclass(frozen=True)
class Part:
    """Triangles of one surface that are measured together.

    edge_degrees  the widest angle between the normals at the ends of their edges
    """

    surface: Surface
    triangles: NDArray[np.int64]
    edge_degrees: float


class _Group(NamedTuple):
    """Cells that see the same pairs: those of one exponent in one space, by their positions."""

    alpha: float
    space: str
    cells: tuple[int, ...]


def measure(context: ProbeContext) -> dict[str, pd.DataFrame]:
    """The rows of meshes.parquet, in the order of surfaces, edges, exponents, pairs and cells."""
    plan = context.plan
    sweep = Sweep(plan, context.registry, list(_cells(plan, context.registry)), [])
    if not sweep.cells:
        context.note(f"no exponent in {ALPHAS[0]:g} .. {ALPHAS[1]:g} is in the plan, so no mesh is measured")
        return {"meshes": MESHES.frame()}
    tasks = list(_tasks(plan, context.note))
    measured = []
    with ThreadPoolExecutor(max_workers=context.jobs) as pool:
        for numbers in pool.map(partial(_measure, sweep=sweep, groups=_groups(sweep.cells)), tasks):
            measured.append(numbers)
            context.advance(1 / len(tasks))
    return {"meshes": _frame(sweep, pd.concat(measured, ignore_index=True))}


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
    """What makes each part: tessellations are made when their turn comes, files are read and described now."""
    for tessellate in meshes.TESSELLATIONS.values():
        for degrees in _edges(plan):
            yield partial(_whole, tessellate, degrees)
    for path in plan.meshes:
        surface = load(path)
        parts, folded = file_parts(surface)
        notes = [*surface.remarks, *surface.notes]
        notes += [f"left out, edges wider than {WIDEST:g} degrees: {folded}"] if folded else []
        note(f"{surface.name}: {len(surface.faces)} triangles" + "".join(f"; {sentence}" for sentence in notes))
        for part in parts:
            yield partial(_same, part)


def _whole(tessellate: Callable[[float], Surface], degrees: float) -> Part:
    surface = tessellate(degrees)
    return Part(surface, np.arange(len(surface.faces)), float(surface.edge_degrees().max()))


def _same(part: Part) -> Part:
    return part


def _cells(plan: Plan, registry: Mapping[str, Approximation]) -> Iterator[Cell]:
    """Cells of the formulas that mesh questions are about, in float32 and with the plan's first slope."""
    names = tuple(n for n in FORMULAS if n in plan.approximations)
    narrowed = replace(
        plan, approximations=names, alphas=_alphas(plan), precisions=("float32",), slopes=plan.slopes[:1], raw=()
    )
    return (cell for cell in narrowed.cells(registry) if cell.gated)


def _groups(cells: Sequence[Cell]) -> dict[float, list[_Group]]:
    """The groups of each exponent."""
    together: dict[tuple[float, str], list[int]] = {}
    for position, cell in enumerate(cells):
        together.setdefault((cell.alpha, cell.formula.space), []).append(position)
    groups: dict[float, list[_Group]] = {}
    for (alpha, space), positions in sorted(together.items()):
        groups.setdefault(alpha, []).append(_Group(alpha, space, tuple(positions)))
    return groups


def _measure(task: Callable[[], Part], sweep: Sweep, groups: dict[float, list[_Group]]) -> pd.DataFrame:
    """Every cell over one part: positions and numbers, which `_frame` makes rows of."""
    part, plan = task(), sweep.plan
    at = points(part.surface, part.triangles, plan.seed, _samples(plan))
    truths = 1 if at.true is None else 2
    sets: list[tuple[str, str, tuple[int, ...]]] = []
    accumulators: list[ErrorAccumulator] = []
    for alpha, alike in groups.items():
        seen = lit(at, alpha)
        for group, pair in itertools.product(alike, PAIRS):
            if (pair == "half") == (group.space == "half"):
                cells = sweep.arrays(group.cells, FLOAT32, truths)
                for normals, errors in _errors(seen, pair, cells):
                    sets.append((normals, pair, group.cells))
                    accumulators.append(errors)
    return _numbers(sets, accumulators, truths).assign(
        mesh=part.surface.name,
        edge_degrees=part.edge_degrees,
        triangles=len(part.triangles),
        left_out=part.surface.left_out,
        samples=_samples(plan),
    )


def _errors(seen: Lit, pair: str, cells: CellArrays) -> Iterator[tuple[str, ErrorAccumulator]]:
    """The errors of cells with raw normals, then with renormalised ones."""
    (alpha,), half = cells.alphas, pair == "half"
    unit = coordinates(FLOAT64, *(np.ascontiguousarray(v) for v in seen.true_pair(pair)))
    exact = np.empty((1, 2, unit.shape[1]))
    exact[0, 0] = of_deficits(unit[FORM_ROW["difference"]], alpha, half)
    deficit = seen.surface_deficit(pair)
    if deficit is not None:
        exact[0, 1] = of_deficits(deficit, alpha, half)
    for normals in NORMALS:
        a, b = (np.ascontiguousarray(v, np.float32) for v in seen.pair(normals, pair))
        errors = ErrorAccumulator(len(cells.rows) * cells.truths)
        cells.measure(Piece.of(FLOAT32, a, b, exact, unit), errors)
        yield normals, errors


def _numbers(
    sets: list[tuple[str, str, tuple[int, ...]]], accumulators: list[ErrorAccumulator], truths: int
) -> pd.DataFrame:
    """The rows of all sets of pairs (normals, pair, cells) as one frame: a frame each took longer than measuring."""
    errors = ErrorAccumulator.stacked(accumulators)
    cells = [cell for _, _, each in sets for cell in each]
    which = np.repeat(np.arange(len(sets)), [truths * len(each) for _, _, each in sets])
    columns: dict[str, Any] = {"cell": np.repeat(cells, truths), "truth": np.tile(np.arange(truths), len(cells))}
    columns |= {name: METRICS[name](errors) for name in _NUMBERS}
    columns["normals"] = tables.looked_up([normals for normals, _, _ in sets], which)
    columns["pair"] = tables.looked_up([pair for _, pair, _ in sets], which)
    return pd.DataFrame(columns)


def _frame(sweep: Sweep, numbers: pd.DataFrame) -> pd.DataFrame:
    """Rows of the table: the key columns of each row's cell beside its numbers."""
    keys = tables.of_cells(sweep, numbers["cell"].to_numpy(np.int64))
    numbers["truth"] = tables.looked_up(TRUTHS, numbers["truth"].to_numpy(np.int64))
    return pd.concat([keys, numbers], axis=1)[MESHES.names]
