"""Fills the pages: parts are made first and written then, so a failure leaves pages and pictures alone."""

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

from phongbench.analysis.rows import Rows
from phongbench.errors import InputError
from phongbench.results.runs import Run
from phongbench.support.atomic_files import write_bytes
from phongbench_reports.readme import column_parts, parts, raw_part, run_parts


def of_run(run: Run) -> dict[str, str]:
    """The parts that a finished run gives, by name."""
    study = Rows(run)
    return {
        "targets": run_parts.by_target(study),
        "glossary": run_parts.glossary(study),
        "columns": column_parts.columns(),
        "verdict": run_parts.verdict(study),
        "shader": run_parts.shader(study),
        "claims": run_parts.claims(run),
        "speed": run_parts.speed(study),
        "raw": raw_part.raw_vectors(study),
        "raw_answer": raw_part.raw_vectors(study),
        "machine": run_parts.machine(run),
    }


def write(root: Path, bodies: Mapping[str, str], files: Mapping[str, bytes] = MappingProxyType({})) -> None:
    """Write these parts, and pictures and a notebook by their path in the checkout; other parts stay as they are."""
    most = parts.LARGEST_PICTURE
    large = [f"{name}: {len(content)} bytes" for name, content in files.items() if len(content) > most]
    if large:
        raise InputError(f"a file is too large: {', '.join(large)}", str(root), f"at most {most}")
    texts = parts.read(root)
    texts = parts.filled(texts, {**parts.parts_of(texts), **bodies})
    for name, content in files.items():
        write_bytes(root / name, content)
    for page, text in texts.items():
        write_bytes(root / page, text.encode("utf-8"))
