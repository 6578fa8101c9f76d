"""Which formula to ship for an error budget: the cheapest one whose largest error is within it, and why.

A stored run tells which formulas there are and what they cost; without one the closed-form laws answer, which know
errors but no times. What is compared with the budget is a promise (`promises`): proven, or searched and widened. What
was measured is told beside it, and decides nothing.
"""

from collections.abc import Mapping, Sequence
from typing import Any

from phongbench.analysis import inverse_errors, kernel_times, law_bounds, measured_errors, raw_vectors
from phongbench.analysis.by_target import cheapest
from phongbench.analysis.choice import Choice, Judge, as_given, choose, promised, remembered
from phongbench.analysis.choice_words import answered
from phongbench.analysis.error_budget import Budget, edge_words, length_error_of
from phongbench.analysis.exponents import Exponents
from phongbench.analysis.promises import DEVICES, UNIT_ON_DEVICES, domain
from phongbench.analysis.target_costs import checked, own_prices, priced, prices, table_of, unit_of
from phongbench.compiler.precisions import FLOAT32, precision_named
from phongbench.errors import InputError, UnknownNameError
from phongbench.formulas.formula import Formula
from phongbench.formulas.user_files import installed
from phongbench.results.records import Row
from phongbench.results.runs import DEFAULT_ROOT, Run, intact
from phongbench.results.schema import BASELINE, CPU
from phongbench.targets.chips import TARGETS
from phongbench.targets.measured import Shelf

#: what a caller holds: vectors, or R.V alone; and the forms that need no more
INPUTS = VECTORS, COSINE = "vectors", "cosine"
COSINE_FORMS = ("dot", "none")
#: the share of an error budget from which on the rounding of a cosine is told
SHOWS = 0.1


def recommend(
    run: Run | None,
    *,
    alpha: Exponents | float | str,
    max_error: float | str,
    length_error: float | str | None = None,
    precision: str = "float32",
    space: str = "reflect",
    working_set: str = "l1",
    target: str = CPU,
    short_of: str | None = None,
    search: bool = True,
    raw: bool = False,
    mesh_angle: float | str | None = None,
    inverse_error: float | str | None = None,
    contract: bool = False,
    inputs: str = VECTORS,
    root: Shelf = DEFAULT_ROOT,
    others: bool = False,
) -> dict[str, Any]:
    """The cheapest formula within an error budget, the next cheapest, and the nearest miss, as plain data.

    run                  a stored run with timing rows, or None: answer from the laws
    alpha                exact Phong's: one, several or a range, as `Exponents.of` reads them, all of which it is for
    max_error            largest absolute error allowed, above 0; text may be a fraction such as 1/255
    length_error         how wrong vector lengths may be, relative, >= 0: 0.01 is up to 1 %; None for unit vectors
    space                reflect (R, V), or half (N, H), judged over all configurations of N, L and V
    working_set          whose times count: l1, l2 or memory
    target, short_of     where the formula will run, as `targets` lists it, and the unit that is scarce there
    search               False: what cannot be proven is not searched either, which takes seconds
    raw                  True: choose among whole recipes from raw N, L and V, see `raw_vectors.recommend`
    mesh_angle           instead: degrees between the normals at the ends of an edge, see `length_error_of`
    inverse_error        how many degrees normals may be off that the formula gives back, see `inverse_errors`
    contract             True: within on every device that keeps the accuracies of WGSL and Vulkan
    inputs               vectors, or cosine: only formulas of R.V itself
    root                 the folder of the runs in which targets were added, or the measurement of the only one
    others               True: `elsewhere`, too, the best choice on each compiled target where it is another formula
    returns              basis ("run" or "laws"), run, the budget, `choices` (best, then next; empty where nothing is
                         within it), `nearest_miss`, `verdict` and `notes`. In each choice `max_abs` is the largest
                         error measured, or a law's; `bound` is what is compared with the budget, None where nothing
                         is promised, and `coverage` what it rests on
    Raises InputError for numbers out of range and for what the run did not measure, naming the command that does;
    UnknownNameError for an unknown precision or space; CorruptRunError for a run whose bytes have changed.
    """
    length_error = _length_error(length_error, mesh_angle)
    budget = Budget.of(alpha, max_error, length_error, precision, space, working_set, contract=contract)
    here = _here(target, short_of, root, inputs, raw=raw)
    notes = [] if mesh_angle is None else [edge_words(mesh_angle)]
    if raw:
        answer = raw_vectors.recommend(run, budget, any_length=length_error is None, notes=notes)
        return answer | ({"elsewhere": []} if others else {})
    known = _known(run, budget, notes, timed=here)
    cells = _costed(known, run, budget, None if here else (target, short_of, root), notes)
    cells = _meant(cells, run, budget, inputs, inverse_error, notes)
    words = _words(cells, budget, _judge(run, budget, search=search))
    notes += _held(cells, budget)
    answer = {**_asked(run, budget), "inputs": inputs, "target": target, "short_of": short_of, **words, "notes": notes}
    untimed = _meant(known, run, budget, inputs, inverse_error, []) if others else []
    return answer | ({"elsewhere": _elsewhere(run, budget, untimed, words["choices"], root)} if others else {})


def _here(target: str, short_of: str | None, root: Shelf, inputs: str, *, raw: bool) -> bool:
    """Whether this machine is meant; InputError or UnknownNameError for what cannot be asked together, or of nobody."""
    if inputs not in INPUTS:
        raise UnknownNameError("inputs", inputs, INPUTS)
    here = checked(target, short_of, root) == CPU
    if raw and (inputs != VECTORS or not here):
        what = "recipes start from N, L and V, and are chosen by their times on this machine"
        raise InputError(what, "raw", "leave raw or inputs and target out")
    return here


def _meant(
    cells: list[Row], run: Run | None, budget: Budget, inputs: str, inverse_error: float | str | None, notes: list[str]
) -> list[Row]:
    """The cells that take what is at hand, and give normals back as well as asked."""
    if inverse_error is not None:
        cells = inverse_errors.within(cells, run, budget.alpha, inverse_error, notes)
    return of_cosine(cells, budget, notes) if inputs == COSINE else cells


def _words(cells: Sequence[Row], budget: Budget, judge: Judge) -> dict[str, Any]:
    """The choice among these cells, with its reasons."""
    choice = choose(cells, budget.max_error, judge)
    return answered(choice, budget, exact=_exact_fits(cells, choice, budget, judge))


def _held(cells: Sequence[Row], budget: Budget) -> list[str]:
    """Of which formulas nothing is promised, and where an answer holds, as notes."""
    unknown = sorted({row["approximation"] for row in cells} - set(installed()))
    lacking = f"{', '.join(unknown)}: only sampled, and the formula is not here, so nothing is promised of it"
    return [*([lacking] if unknown else []), f"what an answer says holds in {budget.precision} {_where(budget)}"]


def _exact_fits(cells: Sequence[Row], choice: Choice, budget: Budget, judge: Judge) -> bool:
    """Whether exact Phong is within the budget; asked only where the choice is not surely cheaper."""
    if choice.best is None or choice.best["ratio_high"] < 1:
        return False
    kept = [judge(row, False) for row in cells if row["approximation"] == BASELINE]
    return any(one.kept and one.bound <= budget.max_error for one in kept)


def of_cosine(cells: Sequence[Row], budget: Budget, notes: list[str]) -> list[Row]:
    """The formulas that need R.V alone; notes receive what rounding that cosine costs, where it shows."""
    precision = precision_named(budget.precision)
    step = precision.eps if precision.saturates else precision.eps / 2  # of floating point it halves below 1
    change = budget.alpha.values[-1] * step / 2
    if change > SHOWS * budget.max_error:
        notes.append(
            f"R.V in {budget.precision} has steps of {step:.3g} below 1, which alone change the highlight by up "
            f"to {255 * change:.2g} 8-bit codes at alpha {budget.alpha.values[-1]:g}: keep the vectors, of which the "
            "difference and cross forms lose less, or R.V in a longer format"
        )
    return [row for row in cells if row["lambda_form"] in COSINE_FORMS]


def _where(budget: Budget) -> str:
    """For which vectors, and on which machines, an answer holds."""
    if budget.contract:
        return f"{DEVICES}, running the code of `phongbench shader`, for {UNIT_ON_DEVICES}"
    return f"for {'vectors rounded to it' if precision_named(budget.precision).saturates else domain(budget.space)}"


def _asked(run: Run | None, budget: Budget) -> dict[str, Any]:
    """Who answers, and to which budget, as plain data."""
    return {
        "basis": "laws" if run is None else "run",
        "run": None if run is None else run.id,
        "alpha": str(budget.alpha),
        "max_error": budget.max_error,
        "length_error": budget.length_error,
        "precision": budget.precision,
        "space": budget.space,
        "working_set": budget.working_set,
        "contract": budget.contract,
    }


def _length_error(length_error: float | str | None, mesh_angle: float | str | None) -> float | str | None:
    return length_error if mesh_angle is None else length_error_of(mesh_angle, length_error)


def _known(run: Run | None, budget: Budget, notes: list[str], *, timed: bool) -> list[Row]:
    """The formulas that apply, each with its error; InputError where the run must be timed and is not."""
    if run is None:
        return law_bounds.cells(budget, notes)
    if timed:
        kernel_times.timed(intact(run))
    return measured_errors.errors(run, budget, notes)


def _costed(
    known: list[Row], run: Run | None, budget: Budget, where: tuple[str, str | None, Shelf] | None, notes: list[str]
) -> list[Row]:
    """These formulas with their times on this machine, or costs on a target: a law has counted work already.

    where  the target, the unit that is scarce there, and where measured targets are looked up; None for this machine
    """
    if where is None:
        return known if run is None else measured_errors.with_times(run, known, budget, notes)
    target, short_of, root = where
    own = own_prices(None if run is None else run.records("costs"), target, short_of, budget.precision, notes)
    return priced(known, budget.alpha.values, target, short_of, notes, root, own)


def _judge(run: Run | None, budget: Budget, *, search: bool) -> Judge:
    if run is None and not budget.contract:
        return as_given
    return promised(budget, installed(), search=search, measured=run is not None)


def _elsewhere(
    run: Run | None, budget: Budget, cells: Sequence[Row], told: Sequence[Mapping[str, Any]], root: Shelf
) -> list[dict[str, Any]]:
    """The best of these cells on each compiled target where it is another formula than the first choice told."""
    if budget.precision != FLOAT32.name:
        return []
    if run is not None:  # of others no code need be written
        cells = [row for row in cells if row["error"] is not None and row["error"] <= budget.max_error]
    formulas = [Formula.of_row(row) for row in cells]
    judge = remembered(_judge(run, budget, search=False))
    kept = None if run is None else run.records("costs")
    best = []
    for target in TARGETS:
        own = own_prices(kept, target, None)
        costs = prices(formulas, budget.alpha.values, table_of(target, root), own=own)
        row = cheapest(zip(costs, cells, strict=True), judge, budget.max_error, unit_of(target, root))
        if row is not None and (not told or str(Formula.of_row(row)) != told[0]["name"]):
            named = {"target": target, "name": str(Formula.of_row(row)), "max_abs": float(row["error"])}
            best.append({key: (row | named)[key] for key in ("target", "name", "cost", "unit", "ratio", "max_abs")})
    return best
