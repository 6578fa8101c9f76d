"""What no device that keeps the accuracies of WGSL and Vulkan exceeds, beside what was measured here and as written."""

import pandas as pd

from phongbench.accuracy.probes.consistency import DEVICES
from phongbench.analysis.rows import Rows
from phongbench_reports.table import Absent, Table
from phongbench_reports.tables.sureness import LAW, headline, largest
from phongbench_reports.text import alpha_is, label, missing, number, records

#: precisions that the standards speak of
HELD = ("float32", "float16")
#: columns of the data, as they are shown
_IN_ORDER = ("written_float32", "float32", "written_float16", "float16")


def devices(study: Rows) -> Table | Absent:
    """Bounds by contract of each formula and form once, in float32 and float16, and what its written code errs by."""
    rows = study.cut(stratum=DEVICES)
    if rows.empty and study.emitted.empty:
        reason = "What a conforming device may err at most was not asked for."
        return Absent(reason, "Run with --probe contract,emitted; the presets standard and full do.")
    data = bounds(rows, study.accuracy, study.emitted)
    alpha = min(data["alpha"].unique(), key=lambda known: abs(known - study.alpha))
    shown = headline(data[(data["alpha"] == alpha) & (data["space"] == "reflect")])
    body = tuple(
        (label(row), *(number(row[name], 3) for name in ("measured", *_IN_ORDER)), _codes(row["float16"]))
        for row in records(shown)
    )
    columns = (f"{what}, {name}" for name in HELD for what in ("as written", "on any device"))
    headings = ("formula", "kernel, float32", *columns, "8-bit codes")
    basis = (
        f"{alpha_is(alpha)}; as written: the code of `phongbench shader`, whose folded constants are another rounding "
        "than the kernel's, each operation rounded to nearest, products fused with sums or not, whichever errs more, "
        "measured; on any device: the same code on all pairs made unit by the device itself, v * inversesqrt(v.v), "
        "with every operation as wrong as WGSL and Vulkan let it be, proven on intervals. A dash: not measured, or the "
        "standards say nothing of what it divides by"
    )
    return Table(headings, body, data, _sentence(shown), basis, frozenset(range(1, 7)))


def bounds(rows: pd.DataFrame, accuracy: pd.DataFrame, emitted: pd.DataFrame) -> pd.DataFrame:
    """One row per formula and exponent: in each precision its bound, and the largest error of its code for shading
    languages; and the largest error of samples in float32.
    """
    written = emitted[emitted["code"] == "gpu"]
    table = pd.concat([rows[LAW], written[LAW]]).drop_duplicates()
    for name in HELD:
        table = table.merge(largest(rows[rows["precision"] == name], LAW, "max_abs", name), on=LAW, how="left")
        mine = largest(written[written["precision"] == name], LAW, "max_abs", f"written_{name}")
        table = table.merge(mine, on=LAW, how="left")
    here = accuracy[(accuracy["stratum"] == "highlight") & (accuracy["precision"] == "float32") & accuracy["gated"]]
    here = here[(here["truth"] == "angle") & (here["perturbation"] == "none")]
    return table.merge(largest(here, LAW, "max_abs", "measured"), on=LAW, how="left")


def _codes(bound: float) -> str:
    return "–" if missing(bound) else number(255 * bound, 3)


def _sentence(shown: pd.DataFrame) -> str:
    """The best in each precision."""
    parts = []
    for name in HELD:
        known = shown[shown[name].notna() & ~shown["approximation"].isin(["phong", "integer-power"])]
        if len(known):
            best = records(known.loc[[known[name].idxmin()]])[0]
            parts.append(f"in {name} {label(best)} stays within {number(best[name], 3)} on every one")
    exact = shown[shown["approximation"] == "phong"]
    if not parts:
        return "What any device may err by was not asked for: what is written was measured alone."
    power = f"; exact Phong's power within {number(exact['float16'].iloc[0], 3)} in float16" if len(exact) else ""
    return f"Whatever device that keeps the standards: {', '.join(parts)}{power}."
