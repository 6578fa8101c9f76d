"""The page: sections in the order of the report, rendered by one template into a folder's index or a single file."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from phongbench.analysis.rows import Rows
from phongbench.formulas.registry import REGISTRY
from phongbench_reports.plots import Plate
from phongbench_reports.table import Absent, Table
from phongbench_reports.tables.claims import ClaimTable
from phongbench_reports.text import listed, number

#: Provenance keys that change from minute to minute: times live in the manifest only; same rows give same bytes.
VOLATILE = re.compile(
    r"(^|[._])(started|finished|created|time|date|when|seconds|duration|uptime|load|pid)", re.IGNORECASE
)
STRATA = ("uniform", "highlight", "peak", "cutoff", "grazing", "lengths", "hostile", "mesh")


@dataclass(frozen=True)
class Section:
    """One section of the page.

    name      str                       anchor, and file name of its figure and CSV
    title     str                       heading
    content   Plate, Table, ClaimTable or Absent    what it shows
    folded    bool                      behind a fold that opens by a click, without JavaScript
    """

    name: str
    title: str
    content: Plate | Table | ClaimTable | Absent
    folded: bool = False

    @property
    def kind(self) -> str:
        """Which part of the template draws it: "figure", "table", "claims" or "absent"."""
        kinds = {Plate: "figure", Table: "table", ClaimTable: "claims", Absent: "absent"}
        return kinds[type(self.content)]


@dataclass(frozen=True)
class Links:
    """Where the page finds its parts: relative paths in a folder, data: addresses in a single file.

    style     str                  contents of the style sheet to embed, "" to link style.css
    figures   name -> (light, dark) addresses of SVGs
    data      name -> address of the CSV
    """

    style: str
    figures: Mapping[str, tuple[str, str]]
    data: Mapping[str, str]


def flat(tree: Mapping[str, Any], prefix: str = "") -> list[tuple[str, str]]:
    """A nested mapping as sorted (dotted key, text) rows, without the keys that hold times."""
    rows: list[tuple[str, str]] = []
    for key, value in sorted(tree.items(), key=lambda item: str(item[0])):
        name = f"{prefix}{key}"
        if VOLATILE.search(name):
            continue
        if isinstance(value, Mapping):
            rows += flat(value, f"{name}.")
        elif isinstance(value, list | tuple):
            rows.append((name, ", ".join(str(entry) for entry in value) or "–"))
        else:
            rows.append((name, "–" if value is None else str(value)))
    return rows


def provenance(study: Rows) -> list[tuple[str, str]]:
    """Machine, versions, flags, seed, command and plan of the run, as rows of text."""
    manifest = study.run.manifest
    top = {key: manifest.get(key) for key in ("run", "state", "schema", "seed", "code")}
    return flat(top) + flat(manifest.get("provenance") or {}) + flat(manifest.get("plan") or {}, "plan.")


def unmeasured(study: Rows) -> list[str]:
    """Sentences on what this run cannot say, computed from what its rows lack."""
    rows, sentences = study.accuracy, []
    lacking = [name for name in ("float32", "float16", "float64") if name not in study.precisions]
    if lacking:
        sentences.append(f"Precision {listed(lacking)}.")
    strata = [name for name in STRATA if name not in set(rows["stratum"].unique())]
    if strata:
        sentences.append(f"Inputs of the {'stratum' if len(strata) == 1 else 'strata'} {listed(strata)}.")
    names = sorted(set(REGISTRY) - set(rows["approximation"].unique()))
    if names:
        sentences.append(f"Formulas {listed(names)}.")
    if study.timing.empty:
        why = "was interrupted before it was timed" if study.awaits_timing else "was made with --no-timing"
        sentences.append(f"Time: the run {why}.")
    else:
        sets = [name for name in ("l1", "l2", "memory") if name not in set(study.timing["working_set"].unique())]
        sentences += [f"Working sets {listed(sets)}."] if sets else []
        threads = int(study.timing["threads"].max())
        sentences.append(f"Time on more than {threads} thread{'s' * (threads > 1)}, on a GPU, or of a single value.")
    if set(rows["coverage"].unique()) == {"sampled"}:
        sentences.append("Proven maxima: a largest error of samples is a lower bound of the true one.")
    sentences.append(f"Exponents other than {listed(f'{alpha:g}' for alpha in study.alphas)}.")
    return sentences


def _environment() -> Environment:
    return Environment(
        loader=PackageLoader("phongbench_reports"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )


def style_sheet() -> str:
    """The text of style.css."""
    environment = _environment()
    assert environment.loader is not None
    return environment.loader.get_source(environment, "style.css")[0]


def render(study: Rows, sections: list[Section], links: Links) -> str:
    """The page as HTML text; every string of the run is escaped by the template."""
    rows = study.accuracy
    facts = {
        "cells": number(len(rows)),
        "samples": number(int(rows["samples"].sum())),
        "alphas": len(study.alphas),
        "formulas": int(rows["approximation"].nunique()),
        "precisions": listed(study.precisions),
        "timings": number(len(study.timing)),
        "partial": study.partial,
    }
    return (
        _environment()
        .get_template("page.html.j2")
        .render(
            name=study.name,
            facts=facts,
            sections=sections,
            links=links,
            unmeasured=unmeasured(study),
            provenance=provenance(study),
            withheld=study.twin_differs,
            violations=study.run.manifest.get("violations") or [],
        )
    )
