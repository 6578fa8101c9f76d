"""Plans as people write them: a TOML file, and the options of a command line."""

import math
from collections.abc import Callable, Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, NamedTuple

from phongbench.errors import InputError
from phongbench.inputs.mtl_files import read_exponents
from phongbench.inputs.plan import PRESETS, Plan, preset
from phongbench.support.documents import Table, load


class Between(NamedTuple):
    """A range of exponents: its ends, and between them as many as a preset has, evenly by their logarithms."""

    low: float
    high: float

    def alphas(self, like: Sequence[float]) -> tuple[float, ...]:
        """Exponents from end to end, at most as far apart, as a ratio, as those of `like` are on average.

        Those between the ends are rounded to three digits. InputError where an end is no exponent, or they are in the
        wrong order.
        """
        low, high = self
        if not (math.isfinite(low) and math.isfinite(high) and 0 < low <= high):
            raise InputError(
                f"{low:g}..{high:g} is no range of exponents", "--alpha", "write the lower one first: 20..80"
            )
        step = math.log(max(like) / min(like)) / max(len(like) - 1, 1) or math.inf
        gaps = max(1, math.ceil(math.log(high / low) / step - 1e-9))
        between = (float(f"{low * (high / low) ** (i / gaps):.3g}") for i in range(1, gaps))
        return tuple(dict.fromkeys((low, *(alpha for alpha in between if low < alpha < high), high)))


#: what the members of a list are, and what errors call them
_MEMBERS: dict[str, tuple[tuple[type, ...], str]] = {
    "alphas": ((int, float), "a number"),
    "gammas": ((int,), "a whole number"),
}


def read_plan(path: Path) -> Plan:
    """A plan from a file: `preset` and any field of Plan; a list of one may be written as its member.

    Raises InputError naming file, line and key for what is missing, malformed, unknown or of the wrong type.
    """
    table = load(path, "plan", "see `phongbench run --help` for an example plan")
    values = {f.name: _value(table, f.name) for f in fields(Plan) if table.has(f.name)}
    table.finish()
    return replace(preset(values.pop("preset", "quick")), **values)


def _value(table: Table, key: str) -> Any:
    wanted: type = type(getattr(PRESETS["quick"], key))
    if wanted is bool:
        return table.flag(key)
    if wanted is int:
        return table.whole(key, None, -(1 << 63), 1 << 63)
    if wanted is float:
        return table.number(key, None, -math.inf, math.inf)
    if wanted is str:
        return table.text(key)
    value = table.value(key)
    types, name = _MEMBERS.get(key, ((str,), "a name"))
    members = value if isinstance(value, list) else [value]
    for i, member in enumerate(members):
        if type(member) not in types:
            raise table.wrong(f"is not {name}", member, key, i)
    return tuple(members)


def compose(
    path: Path | None = None,
    preset_name: str | None = None,
    materials: Path | None = None,
    *,
    scenes: bool = False,
    note: Callable[[str], None] = lambda _: None,
    **options: Any,
) -> Plan:
    """The plan of a command line: a file or a preset, changed by every option that is not None.

    path       a plan's file; excludes preset_name
    materials  MTL file whose distinct shininess values become the exponents
    scenes     whether to add the probe of this name to the others
    note       called with what is odd in the MTL file
    options    fields of Plan; `alphas` may be a range, which is filled as densely as the plan's or preset's own
    """
    if path and preset_name:
        raise InputError("a plan file and --preset were both given", None, "write `preset = ...` into the plan")
    if materials and options.get("alphas"):
        raise InputError("--materials and --alpha were both given", None, "both choose the exponents: leave one out")
    if options.get("probes") == ("none",):
        options["probes"] = ()
    if materials:
        options["alphas"], notes = read_exponents(materials)
        for sentence in notes:
            note(sentence)
    base = read_plan(path) if path else preset(preset_name or "quick")
    if isinstance(ends := options.get("alphas"), Between):
        options["alphas"] = ends.alphas(base.alphas if len(base.alphas) > 1 else preset("quick").alphas)
    plan = replace(base, **{name: value for name, value in options.items() if value is not None})
    return replace(plan, probes=tuple(dict.fromkeys((*plan.probes, "scenes")))) if scenes else plan
