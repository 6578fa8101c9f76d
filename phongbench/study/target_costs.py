"""What a run's formulas cost where they ship: the rows of costs.parquet, from shipped tables, compilers and times.

Costs on a compiled target are looked up in the tables that ship; a formula of yours, which is in none, is compiled
where the target's tools are. One target that cannot answer keeps no other from it.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from typing import Any

import pandas as pd

from phongbench import __version__
from phongbench.errors import InputError, PhongbenchError, UnknownNameError
from phongbench.formulas.formula import Formula
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.shader_code.language import FLOAT32
from phongbench.formulas.spec import Approximation
from phongbench.inputs.plan import Cell
from phongbench.results.formula_columns import FORMULA, RAW
from phongbench.results.schema import CPU, GPU, TABLES
from phongbench.targets.chips import TARGETS
from phongbench.targets.code_shapes import Code, code, shipped_code
from phongbench.targets.costs import CostTable, compiled, in_precision, shipped
from phongbench.targets.measure import CONTEXTS, Cost
from phongbench.targets.target import Target
from phongbench.timing.timed_kernels import ALPHA

#: a formula and the exponent that its code is written for
_Key = tuple[Formula, float]
#: the language and the precision of code
_Written = tuple[str, str]


def checked(targets: Iterable[str]) -> tuple[str, ...]:
    """The targets; UnknownNameError for a name that is none."""
    chosen = tuple(dict.fromkeys(targets))
    for name in chosen:
        if name not in (CPU, GPU, *TARGETS):
            raise UnknownNameError("target", name, (CPU, GPU, *TARGETS), "targets")
    return chosen


@dataclass(frozen=True)
class Costs:
    """The costs of a run's formulas.

    cells     of the run: each formula counts at the exponent nearest to 50 that it was measured at
    registry  the approximations that they name
    note      takes a sentence on what cannot be told
    """

    cells: Sequence[Cell]
    registry: Mapping[str, Approximation]
    note: Callable[[str], None]
    _written: dict[_Written, dict[_Key, Code]] = field(default_factory=dict, init=False, repr=False)
    _lacking: dict[str, list[str]] = field(default_factory=dict, init=False, repr=False)

    def frame(
        self, targets: Sequence[str], timing: pd.DataFrame, adapter: Iterable[Mapping[str, Any]] = ()
    ) -> pd.DataFrame:
        """The rows of costs.parquet for these targets, for all without any.

        timing   the run's times, of which those of the processor are made
        adapter  rows of an adapter of this machine, where it was measured: `gpu.rows` of `codes`
        """
        rows = [*self._timed(timing)] if not targets or CPU in targets else []
        rows += map(dict, adapter)
        for name in targets or TARGETS:
            if name not in (CPU, GPU):
                with self._noted(name):
                    rows += [row for precision in self._precisions(name) for row in self._compiled(name, precision)]
        for reason, names in self._lacking.items():
            self.note(f"own formulas have no cost on {', '.join(names)}: {reason}")
        return TABLES["costs"].frame(rows)

    def _precisions(self, target: str) -> list[str]:
        """float32, and float16 where the run measures it and the target has it."""
        measured = {FLOAT32, *(cell.precision for cell in self.cells)}
        return [p for p in TARGETS[target].precisions if p in measured and (p == FLOAT32 or target in in_precision(p))]

    @property
    def _formulas(self) -> dict[Formula, float]:
        """The run's formulas in order, each with its exponent nearest to 50, of which the smaller one."""
        found: dict[Formula, float] = {}
        for cell in self.cells:
            best = found.setdefault(cell.formula, cell.alpha)
            if abs(cell.alpha / ALPHA - 1) < abs(best / ALPHA - 1):
                found[cell.formula] = cell.alpha
        return found

    def _compiled(self, target: str, precision: str) -> Iterator[dict[str, Any]]:
        """The rows of one target: a row for each formula and context."""
        table = shipped(target, precision)
        codes = self.codes(table.target.language, precision)
        mine = [one for (f, _), one in codes.items() if self._own(f) and table.known(one) is None]
        own = self._made_now(table.target, mine, precision) if mine else None
        for (formula, alpha), one in codes.items():
            for source in filter(None, (table, own)):
                if (cost := source.known(one)) is not None:
                    about = named(formula, alpha, precision)
                    yield from ({**about, **row} for row in compiled_rows(source, cost))
                    break

    def codes(self, language: str, precision: str = FLOAT32) -> dict[_Key, Code]:
        """The formulas' codes in a language and precision that has one for them; most targets share it."""
        if (language, precision) not in self._written:
            codes = {key: self._code(*key, language, precision) for key in self._formulas.items()}
            self._written[language, precision] = {key: one for key, one in codes.items() if one is not None}
        return self._written[language, precision]

    def _code(self, formula: Formula, alpha: float, language: str, precision: str) -> Code | None:
        if not self._own(formula):
            return shipped_code(formula, alpha, language, precision)  # which the report asks for again
        with suppress(InputError):
            return code(formula, alpha, language, self.registry, precision=precision)
        return None

    def _own(self, formula: Formula) -> bool:
        """Whether it is a formula of the user's."""
        return self.registry[formula.approximation] is not REGISTRY.get(formula.approximation)

    def _made_now(self, target: Target, missing: Sequence[Code], precision: str) -> CostTable | None:
        """Costs of codes that no table holds, beside exact Phong by the same compiler; None where it is not here."""
        if (reason := target.why_not()) is not None:
            names = self._lacking.setdefault(reason, [])
            names += [] if target.name in names else [target.name]
            return None
        with self._noted(target.name):
            exact = code(Formula(), ALPHA, target.language, precision=precision)
            return compiled(target, [exact, *missing], precision)
        return None

    def _timed(self, timing: pd.DataFrame) -> Iterator[dict[str, Any]]:
        """The processor's times in its smallest working set on one thread, as costs."""
        sets = set(timing["working_set"])
        place = next((name for name in ("l1", "l2", "memory") if name in sets), "")
        rows = timing[(timing["working_set"] == place) & (timing["threads"] == 1) & timing["lit"].isna()]
        for row in rows[rows["approximation"].isin(list(self.registry))].to_dict("records"):
            yield {
                **{name: row[name] for name in (*FORMULA, *RAW, "precision", "ratio", "ratio_low", "ratio_high")},
                "target": CPU,
                "cost_kind": "measured",
                "alpha": ALPHA,
                "context": 0,
                "reads": 0,
                "unit": "ns",
                "cost": row["ns_min"],
                "over_dot": row["dot_ratio"],
                "tool": "phongbench",
                "tool_version": __version__,
            }

    @contextmanager
    def _noted(self, target: str) -> Iterator[None]:
        """Turn an error about one target into a note: the others go on."""
        try:
            yield
        except PhongbenchError as problem:
            self.note(f"costs on {target} are incomplete: {problem}")


def named(formula: Formula, alpha: float, precision: str = FLOAT32) -> dict[str, Any]:
    """The columns that name a formula at an exponent, whose costs are those of code in a precision."""
    return {
        "approximation": formula.approximation,
        "lambda_form": formula.lambda_form,
        "space": formula.space,
        "beta_policy": formula.slope,
        "gamma": formula.gamma,
        "recipe": formula.recipe,
        "normalise": formula.normalise,
        "precision": precision,
        "alpha": alpha,
    }


def compiled_rows(table: CostTable, cost: Cost) -> Iterator[dict[str, Any]]:
    """What a compiler says of one formula, a row for each context; all but the cost itself is of the first."""
    target, dot, phong = table.target, table.dot, table.baseline
    for place, context in enumerate(CONTEXTS):
        here, bare, exact = (one.around[place] for one in (cost, dot, phong))
        ratio = (bare + here) / (bare + exact) if bare + exact else float("nan")
        yield {
            "target": target.name,
            "cost_kind": "compiled",
            "context": context,
            "reads": 0,
            "unit": target.unit,
            "cost": here,
            "over_dot": (bare + here) / bare if bare else float("nan"),
            **dict.fromkeys(("ratio", "ratio_low", "ratio_high"), ratio),
            "tool": target.tool,
            "tool_version": table.tool_version,
            **(_counts(cost) if context == CONTEXTS[0] else {}),
        }


def _counts(cost: Cost) -> dict[str, Any]:
    return {
        "bound_by": cost.bound_by,
        "issue": cost.issue,
        "busy": cost.special,
        "instructions": cost.instructions,
        "fp32": cost.arithmetic,
        "special": cost.specials,
        "latency": cost.latency or None,
        "registers": cost.registers or None,
    }
