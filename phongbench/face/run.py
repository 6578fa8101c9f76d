"""Studies and what they answer, with tables as DataFrames."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields
from operator import index
from pathlib import Path
from typing import Any

import pandas as pd

from phongbench.analysis import front as fronts
from phongbench.analysis import recommend as advice
from phongbench.analysis.rows import Rows
from phongbench.errors import InputError, UnknownNameError
from phongbench.face.notebook import Front, in_html
from phongbench.formulas.spec import Approximation
from phongbench.formulas.user_files import extended, installed
from phongbench.inputs.plan import PRESETS, Plan, with_own
from phongbench.inputs.plan import preset as plan_of
from phongbench.inputs.plan_files import compose
from phongbench.results import runs
from phongbench.results.answering import run_for
from phongbench.results.runs import DEFAULT_ROOT
from phongbench.study.run import run_study

#: fields of a plan that hold numbers; the other lists hold names
_NUMBERS: Mapping[str, Callable[[Any], float]] = {"alphas": float, "gammas": index}


class Run(runs.Run):
    """A stored run: its folder `path`, its `id`, its tables as DataFrames, and what they answer.

    accuracy  a row for each cell, stratum, truth and coverage
    timing    a row for each timed kernel and working set; empty if timing was left out
    worst     the inputs with the largest errors, as hexadecimal floats
    costs     what its formulas cost on each target: timed here, counted in machine code elsewhere
    `phongbench.run` measures one, `phongbench.load` finds one; the probes' tables are there, too.
    """

    @classmethod
    def of(cls, stored: runs.Run) -> "Run":
        """The run with its answers."""
        return cls(stored.path, stored.manifest)

    def front(self, *, alpha: float | str | None = None, **options: Any) -> Front:
        """See `phongbench.front`."""
        return front(self, alpha=alpha, **options)

    def recommend(self, *, alpha: float | str, max_error: float | str, **options: Any) -> pd.DataFrame:
        """See `phongbench.recommend`."""
        return recommend(run=self, alpha=alpha, max_error=max_error, **options)

    def report(self, out: str | Path | None = None, *, single_file: bool = False) -> Path:
        """Draw the report; the path of its page.

        out          folder to write into  [default: `report` in the run's folder]
        single_file  whether it is one self-contained HTML file
        """
        from phongbench_reports import build

        return build(self, self.path / "report" if out is None else Path(out), single_file=single_file)

    def _repr_html_(self) -> str:
        """For notebooks: what was measured, and the answer at each exponent on each target."""
        return in_html(self)


def run(
    *,
    preset: str = "quick",
    out: str | Path | None = None,
    jobs: int | None = None,
    resume: bool = False,
    fresh: bool = False,
    own: Sequence[Approximation] = (),
    **plan: Any,
) -> Run:
    """Measure a study, as `phongbench run` does, and store it.

    preset  quick, standard or full
    out     folder of the run  [default: a new one in phongbench-runs]
    jobs    threads of the sweep  [default: every core]
    resume  go on with the interrupted run in `out`
    fresh   discard what `out` holds
    own     further approximations to measure, as `load_file` gives them
    plan    what differs from the preset: alphas, gammas, lambda_forms, approximations, slopes, spaces, precisions,
            strata, samples, seed, timing, timing_budget, probes, meshes, targets
    Raises InputError or UnknownNameError for a plan that cannot be, StorageError, LockedError, and
    InterruptedStudyError if it was interrupted.

    >>> run = pb.run(alphas=[10, 50], gammas=[8], approximations=["lyon"], precisions=["float32"],
    ...              samples=2000, timing=False, probes=[])
    >>> sorted(run.accuracy["alpha"].unique().tolist())
    [10.0, 50.0]
    """
    registry = extended(own, installed())
    values = {name: _field(name, value) for name, value in plan.items()}
    values.setdefault("approximations", with_own(plan_of(preset), registry))
    wanted = compose(None, preset, **values).validated(registry)
    done = run_study(
        wanted, None if out is None else Path(out), registry=registry, jobs=jobs, resume=resume, fresh=fresh
    )
    return Run.of(done.run)


def load(name: str | Path = "latest", *, root: str | Path = DEFAULT_ROOT) -> Run:
    """A stored run: by its folder, by its id under `root`, or the newest there.

    Raises InputError where there is none, CorruptRunError where it is not as it was written.

    >>> pb.load("latest").accuracy.empty
    False
    """
    return Run.of(runs.find(str(name), Path(root)))


def front(run: Run | str | Path = "latest", *, alpha: float | str | None = None, **options: Any) -> Front:
    """The error/time front of a run: a row for each formula, the fastest first. Its `plot()` draws it.

    alpha    an exponent, or text with several or a range: "10,50", "10..200"; an error is then the worst over them
             [default: the one of the run that is nearest to 50]
    options  metric, stratum, precision, working_set, space, as for `phongbench front`
    returns  name (the formula's spelling), what it consists of, error, ns, ratio and its interval, state: on, off or
             unresolved. `.attrs` has the question
    Raises InputError for a run without times or exponents that it did not measure.

    >>> pb.front("latest", alpha=10)["state"].isin(["on", "off", "unresolved"]).all()
    np.True_
    """
    stored = _stored(run)
    wanted = Rows(runs.require_rows(stored)).alpha if alpha is None else alpha
    return Front.of(_table(fronts.points(stored, alpha=wanted, **options), "points"))


def recommend(
    *, alpha: float | str, max_error: float | str, run: Run | str | Path | None = None, **options: Any
) -> pd.DataFrame:
    """The cheapest formula whose largest error is within a budget, and the next one; empty where none is.

    alpha      as for `front`
    max_error  largest absolute error, e.g. 1/255
    run        which answers  [default: the newest with times; without any, the closed-form laws]
    options    length_error, precision, space, working_set, as for `phongbench recommend`
    returns    a row for each choice, with its reason (`why`). `.attrs` has the question, `basis` ("run" or "laws"),
               `nearest_miss` and `notes`
    Raises InputError for numbers out of range and for what the run did not measure.

    >>> pb.recommend(alpha=50, max_error=1/255).attrs["basis"]
    'laws'
    """
    stored = run_for(None) if run is None else _stored(run)
    return _table(advice.recommend(stored, alpha=alpha, max_error=max_error, **options), "choices")


def _stored(run: Run | str | Path) -> runs.Run:
    return run if isinstance(run, Run) else runs.find(str(run))


def _table(answer: Mapping[str, Any], rows: str) -> pd.DataFrame:
    """The rows of an answer; all else of it as the table's attributes."""
    table = pd.DataFrame(answer[rows])
    table.attrs = {name: value for name, value in answer.items() if name != rows}
    return table


def _field(name: str, value: Any) -> Any:
    """A field of a plan, from any sequence or number that Python has for it."""
    usual = {field.name: getattr(PRESETS["quick"], field.name) for field in fields(Plan) if field.name != "preset"}
    if name not in usual:
        raise UnknownNameError("field of a plan", name, usual)
    kind = type(usual[name])
    try:
        if kind is tuple:
            members = [value] if isinstance(value, str | int | float) else list(value)
            return tuple(_NUMBERS.get(name, str)(member) for member in members)
        if kind is bool and not isinstance(value, bool):
            raise TypeError
        return kind(value) if kind is float else index(value) if kind is int else value
    except (TypeError, ValueError):
        raise InputError(f"{name} = {value!r} does not fit", name, f"e.g. {name}={usual[name]!r}") from None
