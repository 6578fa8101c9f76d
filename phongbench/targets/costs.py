"""Shipped costs: what every formula of the full study costs on every target, so that nobody needs the compilers.

A file for each target, `costs/<target>.json`, and another for its float16, `costs/<target>.float16.json`, written by
`python -m phongbench.targets`. A cost is found by the shape of the code that is written today: after a change of the
emission a table no longer knows its formulas, and a test says so.
"""

import hashlib
import json
import re
from collections import UserDict
from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass, fields
from functools import cache, cached_property
from pathlib import Path
from typing import Any

from phongbench.errors import CorruptRunError, InputError
from phongbench.formulas.formula import Formula, Registry
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.shader_code.language import FLOAT32
from phongbench.targets.chips import TARGETS, target_named
from phongbench.targets.code_shapes import Code, by_shape, code, shipped_code
from phongbench.targets.measure import Cost, costs, dot_cost
from phongbench.targets.target import Target

FOLDER = Path(__file__).parent / "costs"
#: of the baseline of every ratio
BASELINE = Formula()
_ALPHA = 50.0
_DIGEST = re.compile(r'^ "digest": .*\n', re.MULTILINE)
_COLUMNS = [field.name for field in fields(Cost)]


@dataclass(frozen=True)
class CostTable:
    """The costs on one target, of code in one precision.

    tool_version  of the compiler that said so
    dot           what the bare dot product costs
    rows          shape of the code -> (name of the formula that stands for it, its cost)
    """

    target: Target
    tool_version: str
    dot: Cost
    rows: Mapping[str, tuple[str, Cost]]
    precision: str = FLOAT32

    @property
    def unit(self) -> str:
        """Of its costs."""
        return self.target.unit

    @property
    def language(self) -> str:
        """In which code is looked up."""
        return self.target.language

    def known(self, wanted: Code) -> Cost | None:
        """The cost of code that was compiled; None for other code."""
        row = self.rows.get(wanted.exact_shape) or self.rows.get(wanted.shape)
        return None if row is None else row[1]

    def known_of(self, formula: Formula, alpha: float, registry: Registry = REGISTRY) -> Cost | None:
        """A formula's cost at an exponent, if its code was compiled."""
        return self.known(code(formula, alpha, self.target.language, registry, precision=self.precision))

    @cached_property
    def baseline(self) -> Cost:
        """Exact Phong's cost."""
        return self.of(BASELINE, _ALPHA)

    def of(self, formula: Formula, alpha: float, registry: Registry = REGISTRY) -> Cost:
        """A formula's cost at an exponent; what is not in the table is compiled now.

        Raises InputError, naming the package that is missing, where it cannot be compiled here.
        """
        ours = shipped_code(formula, alpha, self.target.language, self.precision) if registry is REGISTRY else None
        wanted = ours or code(formula, alpha, self.target.language, registry, precision=self.precision)
        found = self.known(wanted)
        return costs(self.target, [wanted])[0] if found is None else found

    def ratio(self, cost: Cost, short_of: str | None = None) -> float:
        """Cost over that of exact Phong, the dot product included in both.

        short_of  the unit that counts, as for `Cost.short_of`
        """
        dot = self.dot.short_of(short_of)
        return (dot + cost.short_of(short_of)) / (dot + self.baseline.short_of(short_of))

    def over_dot(self, cost: Cost) -> float:
        """Cost, the dot product included, over that of the bare dot product."""
        return (self.dot.cost + cost.cost) / self.dot.cost


def place(name: str, precision: str = FLOAT32) -> Path:
    """Where the table of a target lies, whether or not there is one."""
    return FOLDER / (f"{name}.json" if precision == FLOAT32 else f"{name}.{precision}.json")


@cache
def shipped(name: str, precision: str = FLOAT32) -> CostTable:
    """The table of a target that ships; UnknownNameError for another name, CorruptRunError for a changed file.

    InputError for a precision in which none ship: the target has no units for it, or its model does not answer.
    """
    target, path = target_named(name), place(name, precision)
    if precision not in target.precisions:
        fix = f"leave the precision out; these have it: {', '.join(in_precision(precision)) or 'none'}"
        raise InputError(f"no costs of {name} in {precision} ship", "precision", fix)
    if not path.is_file():
        first = "install phongbench again" if precision == FLOAT32 else "leave the precision out"
        fix = f"{first}, or `make targets`; these have it: {', '.join(in_precision(precision)) or 'none'}"
        raise InputError(f"no costs of {name} in {precision} are here", str(path.name), fix)
    text = path.read_text()
    data = json.loads(text)
    if data["digest"] != digest(text):
        raise CorruptRunError(f"the costs of {name} were changed", path.name, "install phongbench again")
    return CostTable(target, data["tool_version"], _cost(data["dot"]), _Rows(data["rows"]), precision)


def in_precision(precision: str) -> list[str]:
    """The targets whose costs in a precision ship."""
    return [name for name, one in TARGETS.items() if precision in one.precisions and place(name, precision).is_file()]


def compiled(target: Target, codes: Sequence[Code], precision: str = FLOAT32) -> CostTable:
    """The table of these codes in one precision, compiled here; InputError where a tool is missing or refuses one."""
    found = by_shape(codes)
    told = costs(target, list(found.values()))
    rows = {shape: (one.name, cost) for (shape, one), cost in zip(found.items(), told, strict=True)}
    return CostTable(target, target.tool_version(), dot_cost(target, precision), rows, precision)


def as_text(table: CostTable) -> str:
    """The table as its file holds it: a line for each row, so that versions can be compared."""
    target = table.target
    head: dict[str, Any] = {
        "target": target.name,
        "chip": target.chip,
        "tool": target.tool,
        "tool_version": table.tool_version,
        "unit": target.unit,
        **({} if table.precision == FLOAT32 else {"precision": table.precision}),
        "columns": ["formula", *_COLUMNS],
        "dot": astuple(table.dot),
    }
    rows = {shape: (named, *astuple(cost)) for shape, (named, cost) in table.rows.items()}
    lines = [f" {json.dumps(key)}: {json.dumps(value)}," for key, value in head.items()]
    after = [' "rows": {', ",\n".join(f"  {json.dumps(shape)}: {json.dumps(row)}" for shape, row in rows.items())]
    after += [" }", "}", ""]
    told = digest("\n".join(["{", *lines, *after]))
    return "\n".join(["{", *lines, f' "digest": "{told}",', *after])


def digest(text: str) -> str:
    """Of the file of a table, but for the line of the digest itself."""
    return hashlib.sha256(_DIGEST.sub("", text, count=1).encode()).hexdigest()


class _Rows(UserDict[str, Any]):
    """Rows of a file; each cost is made when it is asked about, since most never are."""

    def __getitem__(self, shape: str) -> tuple[str, Cost]:
        named, *values = self.data[shape]
        return str(named), _cost(values)


def _cost(values: Sequence[Any]) -> Cost:
    around, *rest = values
    return Cost(tuple(around), *rest)
