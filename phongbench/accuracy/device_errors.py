"""How wrong formulas are on another device: the code that is written for it, run there, against this machine's truths.

Its rows of accuracy say so in the column `device`. The pairs are those of the sweep, its strata and seed, as many as
there is time for; the searched rows come of a search that only the device's own values steer; and of float16 every
cosine is tried. The code limits over-long vectors to 1, as it does by default where it ships.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import pandas as pd

from phongbench.accuracy import tables
from phongbench.accuracy.accumulators import ErrorAccumulator
from phongbench.accuracy.batches import Batch
from phongbench.accuracy.coordinates import Piece
from phongbench.accuracy.device_values import errors_of
from phongbench.accuracy.probes.consistency import UNIT_STRATA, VECTORS
from phongbench.accuracy.probes.exhaustive import COSINES, Domain, seen
from phongbench.accuracy.sweep import Measured, Sweep, exact_values
from phongbench.compiler.lowering import FLOAT16, FLOAT32, Precision
from phongbench.compiler.precisions import Array
from phongbench.errors import InputError
from phongbench.formulas.recipes import PAIR
from phongbench.formulas.shader_code.export import source
from phongbench.formulas.shader_code.languages import language_named
from phongbench.formulas.shader_code.raw_vectors import arguments
from phongbench.inputs.pairs import hold
from phongbench.inputs.plan import Cell
from phongbench.inputs.strata import Stratum
from phongbench.results.schema import ACCURACY, GPU
from phongbench.targets.code_shapes import Code
from phongbench.targets.webgpu.programs import evaluating
from phongbench.targets.webgpu.session import Adapter, Session

#: parts of an error that are not looked for on a device
_PARTS = ("model_max", "length_max", "rounding_max")
#: a search: generations, pairs of each, and the best that its pairs are made around
GENERATIONS, CHILDREN, PARENTS = 8, 2048, 8
#: how far a pair is moved at most, the first and the last time, as multiples of the lobe's width and of 1
_FIRST_STEP, _LAST_STEP = 1.0, 1e-7


@dataclass
class _Devices:
    """The device, the programs of a sweep's cells, and the worst inputs met so far by cell.

    refused  positions of cells whose code it does not take
    """

    session: Session
    sweep: Sweep
    texts: dict[int, str] = field(default_factory=dict)
    refused: set[int] = field(default_factory=set)
    worst: dict[int, list[Array]] = field(default_factory=dict)

    def text(self, position: int) -> str | None:
        """The program of a cell; None where it has none."""
        if position not in self.texts and position not in self.refused:
            try:
                self.texts[position] = _program(self.sweep, self.sweep.cells[position])
            except InputError:  # a trick of processors, or what float16 cannot write
                self.refused.add(position)
        return self.texts.get(position)

    def values(self, positions: Sequence[int], vectors: Sequence[Array]) -> Iterator[tuple[int, Array]]:
        """What the device gives for each cell: its position and float32 (n,).

        vectors  two or three directions, (3, n) each
        """
        known = [p for p in positions if self.text(p) is not None]
        given = np.zeros((vectors[0].shape[1], 3, 4), np.float32)
        for k, vector in enumerate(vectors):
            given[:, k, :3] = vector.T
        found = self.session.ask("values", texts=[self.texts[p] for p in known], given=given)
        for position, values in zip(known, found, strict=True):
            if isinstance(values, str):
                self.refused.add(position)
                del self.texts[position]
            else:
                yield position, values


def _program(sweep: Sweep, cell: Cell) -> str:
    half = cell.precision == FLOAT16.name
    language = language_named("wgsl").in_precision(cell.precision)
    text = source(cell.formula, cell.alpha, language, sweep.registry)
    return evaluating(Code(str(cell.formula), text, len(arguments(cell.formula))), half)


def measure(
    sweep: Sweep, session: Session, adapter: Adapter, alphas: Sequence[float], samples: int, *, thorough: bool
) -> pd.DataFrame:
    """Rows of accuracy, their device GPU: gated cells of float32, and of float16 where the device has it.

    alphas    exponents that are looked at
    samples   pairs of a stratum, at most
    thorough  whether all strata are, and whether cells are searched; else those of unit vectors
    Raises MeasurementError where the device fails.
    """
    held = (FLOAT32, FLOAT16) if adapter.half else (FLOAT32,)
    names = {precision.name for precision in held}
    cells = [
        position
        for position, cell in enumerate(sweep.cells)
        if cell.gated and cell.alpha in alphas and cell.precision in names and position not in sweep.failures
    ]
    device = _Devices(session, sweep)
    frames = [_rows(sweep, measured) for measured in _sampled(device, cells, samples, every=thorough)]
    frames += [_rows(sweep, one).assign(coverage="exhaustive") for one in _cosines(device, cells)]
    if thorough:
        frames.append(_searched(device, cells))
    kept = [frame for frame in frames if len(frame)]
    return pd.concat(kept, ignore_index=True) if kept else ACCURACY.frame()


def _rows(sweep: Sweep, measured: Measured) -> pd.DataFrame:
    alone = replace(sweep, batches=[measured.batch])
    missing = dict.fromkeys(_PARTS, np.nan)
    return tables.accuracy(alone, [tables.part([measured])]).assign(device=GPU, **missing)


def _sampled(device: _Devices, cells: Sequence[int], samples: int, *, every: bool) -> Iterator[Measured]:
    """The cells over pairs of the strata, without hostile ones, whose outcome WGSL leaves open."""
    chosen, sweep = set(cells), device.sweep
    for batch in sweep.batches:
        stratum = batch.stratum.name
        if stratum == "hostile" or not (every or stratum in UNIT_STRATA):
            continue
        mine = [p for p in batch.cells if p in chosen and sweep.cells[p].formula.recipe == batch.recipe]
        if mine:
            yield from _over(device, replace(batch, index=0), mine, min(batch.samples, samples))


def _over(device: _Devices, batch: Batch, cells: Sequence[int], samples: int) -> Iterator[Measured]:
    """The batch's cells over its first pairs."""
    a, b = batch.pairs(device.sweep.plan.seed, 0, samples)
    vectors = [a, b] if batch.recipe == PAIR else [a, b[3:], b[:3]]  # N, L, V
    exact = {alpha: exact_values(batch, alpha, a, b) for alpha in {device.sweep.cells[p].alpha for p in cells}}
    found: dict[int, ErrorAccumulator] = {}
    for position, values in device.values(cells, vectors):
        found[position] = errors_of(values, exact[device.sweep.cells[position].alpha], a, b)
        if batch.stratum.name in UNIT_STRATA and not batch.raw:
            device.worst.setdefault(position, []).append(found[position].worst[0])
    if found:
        whole = replace(batch, cells=tuple(found), samples=samples)
        yield Measured(whole, tuple(found), _stacked(list(found.values()), samples))


def _stacked(errors: Sequence[ErrorAccumulator], samples: int) -> ErrorAccumulator:
    whole = ErrorAccumulator.stacked(errors)
    whole.samples = samples
    return whole


def _cosines(device: _Devices, cells: Sequence[int]) -> Iterator[Measured]:
    """Formulas that see two directions through their cosine alone, over every float16 in [-1, 1]."""
    sweep = device.sweep
    mine = [p for p in cells if seen(sweep.cells[p]) and _where(sweep.cells[p]) == (FLOAT16.name, "reflect")]
    if not mine:
        return
    alphas = sorted({sweep.cells[p].alpha for p in mine})
    values = Domain(FLOAT16, "reflect", True, -1.0, tuple(alphas)).values
    piece = Piece.of_cosines(FLOAT16, values, alphas, False)
    batch = Batch(0, FLOAT16, "reflect", COSINES, 1.0, tuple(mine), len(values))
    found = {
        position: errors_of(given, piece.exact[alphas.index(sweep.cells[position].alpha), :1], piece.a, piece.b)
        for position, given in device.values(mine, [piece.a, piece.b])
    }
    if found:
        whole = replace(batch, cells=tuple(found))
        yield Measured(whole, tuple(found), _stacked(list(found.values()), len(values)))


def _where(cell: Cell) -> tuple[str, str]:
    return cell.precision, cell.formula.space


def _searched(device: _Devices, cells: Sequence[int]) -> pd.DataFrame:
    """A row for each cell of a pair of (R, V): the largest error that a search over nearly unit vectors finds."""
    sweep, results = device.sweep, []
    for position in cells:
        cell = sweep.cells[position]
        if cell.formula.raw or cell.formula.space != "reflect" or position not in device.worst:
            continue
        results.append((position, *_search(device, position)))
    if not results:
        return ACCURACY.frame()
    frame = tables.of_cells(sweep, np.array([position for position, _, _ in results]))
    errors = np.array([worst[0] for _, worst, _ in results])
    above = np.array([worst[2] > worst[1] for _, worst, _ in results])
    frame = frame.assign(
        stratum=VECTORS, perturbation="none", length_error=0.0, truth="angle", coverage="searched", device=GPU,
        samples=[looked for _, _, looked in results], max_abs=errors, codes_8bit=255 * errors,
        max_above=np.where(above, errors, np.nan), max_below=np.where(above, np.nan, errors),
        **dict.fromkeys(("nonfinite", "above_one", "negative", "excluded"), 0),
    )  # fmt: skip
    return frame.reindex(columns=ACCURACY.names)


def _search(device: _Devices, position: int) -> tuple[Array, int]:
    """The worst input of a cell, as ErrorAccumulator.worst has it, and how many pairs were looked at.

    Each generation is made around the worst of those before, ever nearer to them, from the samples' own worst on.
    """
    cell = device.sweep.cells[position]
    precision = FLOAT16 if cell.precision == FLOAT16.name else FLOAT32
    batch = Batch(0, precision, "reflect", Stratum(VECTORS), 1.0, (position,), CHILDREN)
    random = np.random.default_rng([device.sweep.plan.seed, position])
    best = sorted(device.worst[position], key=lambda one: -float(one[0]))[:PARENTS]
    steps = np.geomspace(_FIRST_STEP / np.sqrt(cell.alpha + 1), _LAST_STEP, GENERATIONS)
    for step in steps:
        a, b = _around(np.array(best)[:, 3:], precision, step, random)
        exact = exact_values(batch, cell.alpha, a, b)[0]
        for _, values in device.values((position,), (a, b)):
            error = np.abs(values.astype(np.float64) - exact)
            for place in np.argsort(-np.where(np.isfinite(error), error, -1.0))[:PARENTS]:
                best.append(np.array([error[place], exact[place], values[place], *a[:, place], *b[:, place]]))
        best = sorted((one for one in best if one[0] >= 0), key=lambda one: -float(one[0]))[:PARENTS]
    return best[0], GENERATIONS * CHILDREN


def _around(pairs: Array, precision: Precision, step: float, random: np.random.Generator) -> tuple[Array, Array]:
    """CHILDREN pairs of vectors made unit and rounded, around these (k, 6), moved by up to about `step`."""
    moved = pairs[random.integers(len(pairs), size=CHILDREN)].T.astype(np.float64)
    moved = moved + step * random.random(CHILDREN) ** 3 * random.normal(size=(6, CHILDREN))
    made = []
    for part in (moved[:3], moved[3:]):
        unit = np.ascontiguousarray(part / np.linalg.norm(part, axis=0), precision.carrier)
        hold(precision, unit)
        made.append(unit)
    return made[0], made[1]
