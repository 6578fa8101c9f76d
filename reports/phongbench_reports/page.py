"""The page: sections in the order of the report, rendered by one template into a folder's index or a single file."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import pandas as pd
from jinja2 import Environment, PackageLoader, StrictUndefined

from phongbench.analysis.rows import Rows
from phongbench.formulas.registry import REGISTRY
from phongbench_reports.glossary import LEGEND, WORDS, chips, names
from phongbench_reports.plots import Plate
from phongbench_reports.table import Absent, Table
from phongbench_reports.tables.claims import ClaimTable
from phongbench_reports.tables.code import CodeList
from phongbench_reports.text import counted, listed

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
    content   Plate, Table, ClaimTable, CodeList or Absent    what it shows
    folded    bool                      behind a fold that opens by a click, without JavaScript
    stacked   bool                      a table whose rows are cards on a narrow screen
    """

    name: str
    title: str
    content: Plate | Table | ClaimTable | CodeList | Absent
    folded: bool = False
    stacked: bool = False

    @property
    def kind(self) -> str:
        """Which part of the template draws it: "figure", "table", "claims", "code" or "absent"."""
        kinds = {Plate: "figure", Table: "table", ClaimTable: "claims", CodeList: "code", Absent: "absent"}
        return kinds[type(self.content)]

    @property
    def empty(self) -> bool:
        """Whether the run has nothing to show here, and how to get it is all that can be said."""
        return isinstance(self.content, Absent) and bool(self.content.fix)

    @property
    def data(self) -> pd.DataFrame | None:
        """What its CSV holds; None where it has none."""
        return None if isinstance(self.content, Absent | CodeList) else self.content.data


@dataclass(frozen=True)
class Links:
    """Where the page finds its parts: relative paths in a folder, data: addresses in a single file.

    style     str                  contents of the style sheet to embed, "" to link style.css
    figures   name -> (light, dark) addresses of SVGs; dark is "" where the first is both
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


def _on_gpu(study: Rows) -> bool:
    """Whether a GPU was measured; a software adapter is none."""
    return not study.run.manifest.get("gpu", {"software": True})["software"]


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
        gpu = "" if _on_gpu(study) else ", on a GPU,"
        sentences.append(f"Time on more than {threads} thread{'s' * (threads > 1)}{gpu} or of a single value.")
    if set(rows["coverage"].unique()) == {"sampled"}:
        sentences.append("Proven maxima: a largest error of samples is a lower bound of the true one.")
    sentences.append(f"Exponents other than {listed(f'{alpha:g}' for alpha in study.alphas)}.")
    return sentences


def lacking(sections: Iterable[Section]) -> list[str]:
    """A sentence for each reason why sections are empty, with their titles and what fills them."""
    titles: dict[tuple[str, str], list[str]] = {}
    for one in sections:
        if isinstance(one.content, Absent) and one.empty:
            titles.setdefault((one.content.reason, one.content.fix), []).append(one.title)
    return [f"{'; '.join(named)}: {reason} {fix}" for (reason, fix), named in titles.items()]


def legend(sections: Iterable[Section]) -> list[tuple[str, list[str]]]:
    """Words of the first table with their meanings, cut at backticks: every second piece is code."""
    answer = next((one.content for one in sections if one.name == "by_target"), None)
    told = {word: WORDS[word] for word in LEGEND}
    if isinstance(answer, Table):
        told["names"] = names(answer.data["name"].dropna().unique())
        told["targets"] = chips(answer.data["target"].unique())
    return [(word, meaning.split("`")) for word, meaning in told.items() if meaning]


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
    """The page as HTML text; every string of the run is escaped by the template.

    sections  in page order; of empty ones the page tells at its end what fills them
    """
    rows = study.accuracy
    facts = [
        counted(int(rows["approximation"].nunique()), "formula"),
        counted(len(study.alphas), "exponent"),
        listed(study.precisions),
        counted(len(rows), "accuracy row"),
        counted(int(rows["samples"].sum()), "sample"),
        counted(len(study.timing), "timing row"),
    ]
    return (
        _environment()
        .get_template("page.html.j2")
        .render(
            name=study.name,
            facts=facts,
            partial=study.partial,
            sections=[section for section in sections if not section.empty],
            legend=legend(sections),
            links=links,
            unmeasured=[*unmeasured(study), *lacking(sections)],
            provenance=provenance(study),
            withheld=study.twin_differs,
            violations=study.run.manifest.get("violations") or [],
        )
    )
