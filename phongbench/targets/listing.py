"""Which targets there are, what each rests on, and what it lacks here."""

from pathlib import Path
from typing import Any

from phongbench.errors import InputError
from phongbench.results.runs import DEFAULT_ROOT
from phongbench.results.schema import CPU, GPU
from phongbench.targets import measured
from phongbench.targets.chips import TARGETS
from phongbench.targets.costs import place, shipped
from phongbench.targets.target import Target
from phongbench.targets.webgpu import session

_PAGE = "the GPU of whoever opens the explorer", "WebGPU in a browser", "add one: phongbench targets add"


def listing(root: Path = DEFAULT_ROOT) -> list[dict[str, Any]]:
    """Every target as plain data, those that were added among the runs of `root` last.

    name, title, cost_kind   measured: a time with an interval; compiled: what the chip's compiler says of its code
    available, why_not       whether it answers here, and what it lacks if not
    rows                     how many codes have a cost; None where runs have them
    precisions               rows by the precision of the code, where they ship
    unit, tool, tool_version of a cost, and of what says so
    compiles, needs          whether other formulas can be compiled here, and what is missing if not
    """
    title, tool, why = _PAGE
    here = [
        _row(CPU, "this machine's processor", measured.KIND, "phongbench run", why_not=None),
        _adapter(),
        _row("page", title, measured.KIND, tool, why_not=why),
    ]
    compiled = [_compiled(target) for target in TARGETS.values()]
    return here + compiled + [_added(name, root) for name in measured.names(root)]


def _adapter() -> dict[str, Any]:
    adapter, lacking = session.found()
    if adapter is None:
        return _row(GPU, "a GPU of this machine", measured.KIND, "WebGPU", why_not=lacking)
    version = f"wgpu {adapter.version}, {adapter.driver}"
    return _row(GPU, adapter.title, measured.KIND, "WebGPU", why_not=None, tool_version=version)


def _added(name: str, root: Path) -> dict[str, Any]:
    try:
        table = measured.added(name, root)
    except InputError as problem:
        return _row(name, "measured elsewhere", measured.KIND, "", why_not=str(problem))
    more = {"rows": len(table.rows), "tool_version": table.tool_version}
    return _row(name, table.adapter, measured.KIND, table.tool, why_not=None, **more)


def _compiled(target: Target) -> dict[str, Any]:
    here, lacking = place(target.name).is_file(), target.why_not()
    table = shipped(target.name) if here else None
    kept = [precision for precision in target.precisions if place(target.name, precision).is_file()]
    return _row(
        target.name,
        f"{target.title}, scheduled as {target.model}" if target.model else target.title,
        "compiled",
        target.tool,
        why_not=None if here else lacking,
        unit=target.unit,
        rows=len(table.rows) if table else 0,
        precisions={precision: len(shipped(target.name, precision).rows) for precision in kept},
        tool_version=table.tool_version if table else None,
        needs=lacking,
        compiles=lacking is None,
    )


def _row(name: str, title: str, kind: str, tool: str, *, why_not: str | None, **more: Any) -> dict[str, Any]:
    first = {"name": name, "title": title, "cost_kind": kind, "available": why_not is None, "why_not": why_not}
    rest = {"unit": "ns", "rows": None, "precisions": None, "tool_version": None, "needs": None, "compiles": None}
    return {**first, "tool": tool, **rest, **more}
