"""All that `phongbench bench` measures, and what of it a performance ledger keeps."""

from collections.abc import Iterator, Mapping
from typing import Any

from phongbench.benchmarks import bounds, call_bench, kernel_bench, study_bench
from phongbench.benchmarks.call_bench import YARDSTICK
from phongbench.results.ledgers import Entry
from phongbench.support.progress import Progress

#: what kernels and the machine's loops are timed against: the loop over the same arrays that only adds
SUMS = "reading and adding"


def measure(
    names: tuple[str, ...] | None, *, budget_seconds: float, studies: int, progress: Progress
) -> dict[str, Any]:
    """The document of `kernel_bench.bench`, with `calls` of `call_bench.measure` and `stages` of `study_bench.stages`.

    studies  quick studies whose stages are timed; 0 leaves stages out
    """
    answer = kernel_bench.bench(names, budget_seconds=budget_seconds, progress=progress)
    answer["calls"], told = call_bench.measure(answer["ceilings"], progress=progress)
    answer["stages"] = study_bench.stages(studies, progress) if studies else []
    few = study_bench.note(studies) if studies else None
    answer["notes"] += [*told, *([few] if few else [])]
    return answer


def entries(answer: Mapping[str, Any]) -> Iterator[Entry]:
    """What a ledger keeps of a measured document."""
    for row in answer["ours"]:
        yield _entry(row, "ns", SUMS)
    for row in (*answer["calls"], *answer["stages"]):
        yield _entry(row, "seconds", YARDSTICK)
    sweep = answer["sweep"]
    low, high = sweep["ratio_low"], sweep["ratio_high"]
    yield Entry(
        part="sweep",
        name="evaluations",
        place="one core",
        value=1e9 / sweep["evaluations_per_second"],
        unit="ns",
        over="plain NumPy's evaluations",
        ratio=1 / sweep["ratio"],
        ratio_low=None if high is None else 1 / high,
        ratio_high=None if low is None else 1 / low,
        rounds=sweep["rounds"],
    )


def _entry(row: Mapping[str, Any], unit: str, over: str) -> Entry:
    same = {name: row[name] for name in ("part", "name", "place", "ratio", "ratio_low", "ratio_high", "rounds")}
    return Entry(**same, value=row[unit], unit=unit, over=over)


def ceilings(answer: Mapping[str, Any]) -> list[tuple[Any, ...]]:
    """What one core does in a nanosecond, by working set: float32 multiply-adds, vector operations, roots, bytes."""
    return [
        (
            place,
            rates[bounds.PORTS] * bounds.lanes(),
            *(rates[unit] for unit in (bounds.VECTORS, bounds.ROOTS, bounds.BYTES)),
        )
        for place, rates in answer["ceilings"].items()
        if rates
    ]
