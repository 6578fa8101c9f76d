"""`make docs`: fills the generated parts of README.md, the only way a number gets in there.

A part stands between `<!-- generated: NAME -->` and `<!-- /generated: NAME -->`. Everything is measured first and
written last, so a run that fails leaves README and pictures as they were.
"""

from __future__ import annotations

import html
import json
import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import click
import pandas as pd

from phongbench import results
from phongbench.errors import InputError, MeasurementError, PhongbenchError
from phongbench.results import Run
from phongbench_reports.build import write
from phongbench_reports.drawing import Plate, ink, svg_pair
from phongbench_reports.figures import front as front_figure
from phongbench_reports.figures import speed as speed_figure
from phongbench_reports.study import CEILINGS, HEADLINE_ALPHA, Absent, Study, nearest
from phongbench_reports.tables import verdict as verdict_table
from phongbench_reports.text import BUDGETS, number, records

NAMES = ("verdict", "front", "speed", "throughput", "machine")
CHECKOUT = Path(__file__).resolve().parents[2]
README, PICTURES = "README.md", Path("reports/pictures")
#: exponents of the verdict table, the nearest ones of the run; the report has them all
ALPHAS = (10.0, 20.0, 50.0, 100.0, 200.0, 1000.0)
#: bytes a picture may have: a repository keeps every version of it
LARGEST_PICTURE = 100_000
_PART = re.compile(r"(<!-- generated: (?P<name>\w+) -->\n)(?P<body>.*?)(<!-- /generated: (?P=name) -->)", re.DOTALL)


@dataclass(frozen=True)
class Wall:
    """What the study took as a command, from start to exit of its process.

    name      str                cold or warm
    document  what `phongbench run --json` printed
    seconds   float              wall time of the process
    """

    name: str
    document: Mapping[str, Any]
    seconds: float


@dataclass(frozen=True)
class _Cut:
    """A run with other accuracy rows: the attributes of phongbench.results.Run that figures read."""

    path: Path
    manifest: Mapping[str, Any]
    accuracy: pd.DataFrame
    timing: pd.DataFrame
    worst: pd.DataFrame


# the parts


def table(headings: Sequence[str], rows: Sequence[Sequence[str]], *, right: Sequence[int] = ()) -> str:
    """A Markdown table; columns numbered in `right` are set right-aligned."""
    rule = ["--:" if index in right else "---" for index in range(len(headings))]
    lines = [headings, rule, *([cell.replace("|", "\\|") for cell in row] for row in rows)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def verdict(study: Study) -> str:
    """The report's verdict table within 1/255, at a few exponents."""
    budget, name = BUDGETS[0]
    found = verdict_table(study, study.precision, budget, name)
    if isinstance(found, Absent) or study.timing.empty:
        raise InputError(
            "the run has no timing", str(study.run.path), "the README needs a run made without --no-timing"
        )
    wanted = {nearest(study.alphas, alpha) for alpha in ALPHAS}
    rows = [row for row, alpha in zip(found.rows, found.data["alpha"], strict=True) if alpha in wanted]
    shown = table(found.headings, rows, right=sorted(found.numeric))
    return f"{shown}\n\n{found.takeaway}\n({found.basis}.)"


def front(study: Study) -> tuple[str, dict[str, bytes]]:
    """The front at one exponent as a picture for light and dark pages, and the two files it shows."""
    alpha = nearest(study.alphas, HEADLINE_ALPHA)
    run = study.run
    rows = study.accuracy[study.accuracy["alpha"] == alpha]
    with ink():
        plate = front_figure.draw(Study(cast(Run, _Cut(run.path, run.manifest, rows, run.timing, run.worst))))
        if isinstance(plate, Absent):
            raise InputError(plate.reason.rstrip("."), str(run.path), plate.mend.rstrip("."))
        light, dark = map(slim, svg_pair(plate.figure, "front"))
    files = {"front.svg": light, "front-dark.svg": dark}
    return picture("front", plate), files


def picture(name: str, plate: Plate) -> str:
    """HTML that shows the light or the dark file as the reader's page is, with its takeaway below."""
    lines = (
        "<picture>",
        f'  <source media="(prefers-color-scheme: dark)" srcset="{PICTURES}/{name}-dark.svg">',
        f'  <img alt="{html.escape(plate.alt)}" src="{PICTURES}/{name}.svg">',
        "</picture>",
    )
    return "\n".join(lines) + f"\n\n{plate.takeaway}"


def slim(svg: bytes) -> bytes:
    """The picture with coordinates of two digits after the point, which no eye tells apart, and one line each."""

    def tag(found: re.Match[str]) -> str:
        short = re.sub(r"-?\d+\.\d{3,}", lambda n: f"{float(n[0]):.2f}".rstrip("0").rstrip("."), found[0])
        return re.sub(r"\s*\n\s*", " ", short)

    text = re.sub(r"<[^!?][^>]*>", tag, svg.decode("utf-8"))
    return text.encode("utf-8")


def speed(study: Study) -> str:
    """Times as ratios to exact Phong for each working set; of most formulas the cheapest lambda form only."""
    rows = speed_figure.rows_of(study)
    rows = rows[~rows["approximation"].isin(CEILINGS)]
    rows = rows[rows["lambda_form"].isin(["dot", "none"]) | (rows["approximation"] == "lyon")]
    kernel = ["approximation", "lambda_form", "gamma", "working_set"]
    # lyon on (N, H) runs the code of lyon on (R, V) and was timed once
    rows = rows.sort_values(["space"], ascending=False, kind="stable").drop_duplicates(kernel)
    sets = [name for name in speed_figure.SETS if (rows["working_set"] == name).any()]
    ratios = {(row["label"], row["working_set"]): _interval(row) for row in records(rows)}
    first = rows[rows["working_set"] == sets[0]].sort_values(["ratio", "label"], kind="stable")
    names = [speed_figure.SETS[name] for name in sets]
    headings = (
        "formula",
        f"ns, {names[0]}",
        *(f"/ exact Phong, {name}" for name in names),
        f"/ dot product, {names[0]}",
    )
    lines = [
        (
            row["label"],
            number(row["ns_min"]),
            *(ratios.get((row["label"], s), "–") for s in sets),
            number(row["dot_ratio"]),
        )
        for row in records(first)
    ]
    with ink():
        plate = speed_figure.draw(study)
    told = plate.takeaway if isinstance(plate, Plate) else plate.reason
    basis = plate.basis if isinstance(plate, Plate) else ""
    shown = table(headings, lines, right=range(1, len(headings)))
    return f"{shown}\n\n{told}\n({study.precision}, {basis}; in brackets the interval of the ratio.)"


def _interval(row: Mapping[str, Any]) -> str:
    if row["approximation"] == "phong":
        return "1"
    return f"{number(row['ratio'])} ({number(row['ratio_low'])} to {number(row['ratio_high'])})"


def throughput(rates: Mapping[str, float], walls: Sequence[Wall] = ()) -> str:
    """Evaluations a second of the sweep beside plain NumPy's, and the wall times of the study, where measured."""
    plain, ours = rates["numpy_evaluations_per_second"], rates["evaluations_per_second"]
    lines = [
        ("plain NumPy", f"{number(round(plain / 1e6, 1))} million", "1"),
        ("phongbench", f"{number(round(ours / 1e6))} million", f"{number(rates['ratio'])}"),
    ]
    shown = table(("sweep", "evaluations per second and core", "/ NumPy"), lines, right=(1, 2))
    if not walls:
        return shown
    size = walls[0].document
    stages = ("accuracy", "timing", "report")
    times = [
        (wall.name, *(f"{wall.document['seconds'][stage]:.1f} s" for stage in stages), f"{wall.seconds:.1f} s")
        for wall in walls
    ]
    told = (
        f"The quick study, {number(size['cells'])} cells and {number(round(size['evaluations'] / 1e9, 1))} billion "
        "evaluations, as a command: cold with no kernel compiled yet, warm the same command again."
    )
    seconds = table(("kernel cache", *stages, "the whole command"), times, right=range(1, len(stages) + 2))
    return f"{shown}\n\n{told}\n\n{seconds}"


def machine(manifest: Mapping[str, Any]) -> str:
    """Machine, versions and plan of the run, in one paragraph."""
    known, plan = manifest["provenance"], manifest["plan"]
    m, versions, flags = known["machine"], known["versions"], known["flags"]
    caches = ", ".join(
        f"{name} {_bytes(m['caches'][key])}" for name, key in (("L1", "l1"), ("L2", "l2"), ("last level", "last"))
    )
    kind = "a virtual machine" if m["hypervisor"] else "no virtual machine"
    packages = ", ".join(f"{name} {versions[key]}" for name, key in (
        ("Python", "python"), ("NumPy", "numpy"), ("numba", "numba"), ("llvmlite", "llvmlite"), ("phongbench", "phongbench"),
    ))  # fmt: skip
    return (
        f"{m['cpu']} ({m['architecture']}, {kind}), {m['cores']} cores, {m['threads']} threads, caches {caches}, "
        f"{flags['vector_bits']}-bit vectors, {m['system']}. {packages}. Preset {plan['preset']}, seed "
        f"{manifest['seed']}, {number(plan['samples'])} pairs for each cell and stratum; code {manifest['code']}."
    )


def _bytes(size: int) -> str:
    return f"{size >> 20} MiB" if size >= 1 << 20 else f"{size >> 10} KiB"


# the file


def parts_of(text: str) -> dict[str, str]:
    """The generated parts of a text, name to body; InputError unless every one of NAMES is there once and no other."""
    found = [(part["name"], part["body"].strip()) for part in _PART.finditer(text)]
    if sorted(name for name, _ in found) != sorted(NAMES):
        there = ", ".join(name for name, _ in found) or "none"
        raise InputError(f"the generated parts are {there}", README, f"keep the marks of {', '.join(NAMES)}, each once")
    return dict(found)


def filled(text: str, bodies: Mapping[str, str]) -> str:
    """The text with its generated parts replaced; all else stays as it is."""
    parts_of(text)
    return _PART.sub(lambda part: f"{part[1]}\n{bodies[part['name']].strip()}\n\n{part[4]}", text)


def problems(root: Path) -> list[str]:
    """What is missing in the structure of README and pictures; an empty list if nothing is."""
    text = _readme(root)
    told = [f"the part {name} is empty" for name, body in parts_of(text).items() if not body]
    for name in sorted(set(re.findall(r'(?:src|srcset)="([^"]+)"', text))):
        file = root / name
        if not file.is_file():
            told.append(f"{name} is shown and not there")
        elif file.stat().st_size > LARGEST_PICTURE:
            told.append(f"{name} has {file.stat().st_size} bytes, more than {LARGEST_PICTURE}")
    return told


def _readme(root: Path) -> str:
    try:
        return (root / README).read_text(encoding="utf-8")
    except OSError as problem:
        raise InputError(f"cannot be read: {problem.strerror}", str(root / README), "run it in a checkout") from problem


def fill(root: Path, run: Run, rates: Mapping[str, float], walls: Sequence[Wall] = ()) -> None:
    """Write README's generated parts and the pictures from a finished run and what was measured beside it."""
    study = Study(run)
    shown, files = front(study)
    bodies = {
        "verdict": verdict(study), "front": shown, "speed": speed(study), "throughput": throughput(rates, walls),
        "machine": machine(run.manifest),
    }  # fmt: skip
    large = [f"{name}: {len(content)} bytes" for name, content in files.items() if len(content) > LARGEST_PICTURE]
    if large:
        raise InputError(f"a picture is too large: {', '.join(large)}", str(PICTURES), f"at most {LARGEST_PICTURE}")
    text = filled(_readme(root), bodies)
    for name, content in files.items():
        write(root / PICTURES / name, content)
    write(root / README, text.encode("utf-8"))


# what is measured


def study_as_command(name: str, folder: Path, cache: Path, extra: Sequence[str] = ()) -> Wall:
    """Run the quick study in a process of its own, with its kernels cached in `cache`."""
    command = [sys.executable, "-m", "phongbench", "run", "--preset", "quick", "--out", str(folder), "--json", *extra]
    started = time.perf_counter()
    done = subprocess.run(
        command,
        check=False,
        stdout=subprocess.PIPE,
        cwd=folder.parent,
        env={**os.environ, "PHONGBENCH_CACHE": str(cache)},
    )
    seconds = time.perf_counter() - started
    if done.returncode:
        raise MeasurementError(
            f"the {name} study ended with exit code {done.returncode}", "phongbench run", "see above"
        )
    return Wall(name, json.loads(done.stdout), seconds)


def _measured(root: Path, run_name: str | None) -> None:
    from phongbench.yardstick import throughput as measure_throughput

    walls: list[Wall] = []
    with ExitStack() as stack:
        if run_name is None:
            folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="phongbench-docs-")))
            for name in ("cold", "warm"):
                click.echo(f"the quick study, {name}", err=True)
                walls.append(study_as_command(name, folder / name, folder / "cache"))
            run_name = str(folder / "warm")
        run = results.find(run_name, results.DEFAULT_ROOT)
        click.echo("the sweep against plain NumPy", err=True)
        rates = measure_throughput()
        click.echo("drawing", err=True)
        fill(root, run, rates, walls)
    click.echo(f"{README}: {', '.join(NAMES)}", err=True)


@click.command()
@click.option("--run", "run_name", metavar="RUN", help="Use this finished run; wall times of the study are left out.")
@click.option(
    "--check", is_flag=True, help="Only tell whether every generated part is there and filled; exit 1 if not."
)
@click.option("--root", type=click.Path(path_type=Path), default=CHECKOUT, help="The checkout.  [default: this one]")
def main(run_name: str | None, check: bool, root: Path) -> None:
    """Fill the generated parts of README.md by measuring on this machine; let nothing else run meanwhile."""
    try:
        if not check:
            _measured(root, run_name)
        found = problems(root)
    except PhongbenchError as problem:
        raise click.ClickException(str(problem)) from problem
    for line in found:
        click.echo(f"{README}: {line}; `make docs` fills it", err=True)
    if found:
        sys.exit(1)


if __name__ == "__main__":
    main()
