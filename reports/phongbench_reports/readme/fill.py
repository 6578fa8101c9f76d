"""Fills the pages: every part is made first and all is written last, so a failure leaves pages and pictures alone."""

from collections.abc import Mapping
from pathlib import Path

from phongbench.analysis.rows import Rows
from phongbench.errors import InputError
from phongbench.results.runs import Run
from phongbench.support.atomic_files import write_bytes
from phongbench_reports.readme import bench_parts, column_parts, heads_part, parts, raw_part, run_parts
from phongbench_reports.readme.markdown import PICTURES
from phongbench_reports.readme.measurements import Measurements


def fill(root: Path, run: Run, measured: Measurements) -> None:
    """Write the generated parts and the pictures from a finished run and what was measured beside it."""
    bodies, files = of_run(run)
    bodies |= {
        "peers": bench_parts.peers(measured.compared),
        "alarms": bench_parts.alarms(measured.alarms),
        "throughput": bench_parts.throughput(measured.compared["sweep"], measured.walls),
        "scenes": bench_parts.scenes(measured.scenes),
        "service": measured.service,
    }
    write(root, bodies, files)


def of_run(run: Run) -> tuple[dict[str, str], dict[str, bytes]]:
    """The parts that a finished run gives, by name, and the pictures that they show."""
    study = Rows(run)
    front, files = run_parts.front(study)
    bodies = {
        "targets": run_parts.by_target(study),
        "columns": column_parts.columns(),
        "heads": heads_part.heads(),
        "verdict": run_parts.verdict(study),
        "front": front,
        "shader": run_parts.shader(study),
        "claims": run_parts.claims(run),
        "speed": run_parts.speed(study),
        "raw": raw_part.raw_vectors(study),
        "raw_answer": raw_part.raw_answer(study),
        "machine": run_parts.machine(run),
    }
    return bodies, files


def write(root: Path, bodies: Mapping[str, str], files: Mapping[str, bytes]) -> None:
    """Write these parts and pictures; parts that are not given stay as they are."""
    most = parts.LARGEST_PICTURE
    large = [f"{name}: {len(content)} bytes" for name, content in files.items() if len(content) > most]
    if large:
        raise InputError(f"a picture is too large: {', '.join(large)}", str(PICTURES), f"at most {most}")
    texts = parts.read(root)
    texts = parts.filled(texts, {**parts.parts_of(texts), **bodies})
    for name, content in files.items():
        write_bytes(root / PICTURES / name, content)
    for page, text in texts.items():
        write_bytes(root / page, text.encode("utf-8"))
