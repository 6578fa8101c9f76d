"""How long the larger presets would take on more and more cores, and what limits each: on paper, from a short trial."""

from collections.abc import Sequence

from phongbench.inputs.plan import preset
from phongbench.study import forecast
from phongbench.study.forecast import Forecast
from phongbench.support.process import cores
from phongbench_reports.readme.markdown import table

PRESETS, CORES = ("standard", "full"), (1, 16, 256, 4096)
_UNITS = ((86_400.0, "d"), (3600.0, "h"), (60.0, "min"))


def predicted(presets: Sequence[str] = PRESETS) -> str:
    """A table of the seconds that a forecast gives, and where they come from."""
    lines = []
    for name in presets:
        trial = forecast.tried(preset(name))
        lines += [_line(name, count, trial.on(cores(), None if count == 1 else count)) for count in CORES]
    headings = ("preset", "cores", "sweep", "probes", "times", "in all", "longest")
    note = (
        f"Cores like those of this machine, kernels compiled. Probes and times stay on the client, here with {cores()} "
        f"cores. Allowed are {forecast.LOAD_SECONDS * 1e3:g} ms for loading a kernel, {forecast.SHARD_SECONDS * 1e3:g} "
        f"ms for handing out a shard and taking what it gave, {forecast.ROW_SECONDS * 1e6:g} µs for a row."
    )
    return f"{table(headings, lines, right=range(1, len(headings) - 1))}\n\n{note}"


def _line(name: str, count: int, told: Forecast) -> tuple[str, ...]:
    total = sum(told.seconds.values())
    return name, str(count), *(_time(value) for value in (*told.seconds.values(), total)), told.limited_by


def _time(seconds: float) -> str:
    """Two digits and a unit: 45 s, 3.2 min, 11 h."""
    length, unit = next((pair for pair in _UNITS if seconds >= pair[0]), (1.0, "s"))
    return f"{seconds / length:.2g} {unit}"
