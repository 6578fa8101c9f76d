"""The report as files: whole, the same bytes for the same rows, inert to user strings, free of outside references."""

from __future__ import annotations

import os
import re
import shutil
import stat
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest

import phongbench_reports
from phongbench.analysis.rows import Rows
from phongbench.errors import InputError
from phongbench_reports.figures import FIGURES
from phongbench_reports.table import Table
from phongbench_reports.tables.by_target import by_target
from phongbench_reports.tables.code import GPU, PROCESSOR, CodeList, code

HERE = Path(__file__).parent
#: Elements without an end tag.
VOID = {"meta", "link", "img", "source", "br", "wbr"}


class Page(HTMLParser):
    """Elements of a page, with a check that every tag is closed."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.open: list[str] = []
        self.text = ""
        self.feed(text)
        assert not self.open

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text += data

    def all(self, tag: str) -> Iterator[dict[str, str | None]]:
        return (attributes for name, attributes in self.elements if name == tag)


def page_of(index: Path) -> Page:
    return Page(index.read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def page(report: Path) -> Page:
    return page_of(report / "index.html")


def contents(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


#: what the made-up run has no rows for
LACKING = ("raw_vectors", "step_costs")
DRAWN = [figure for figure in FIGURES if figure.name not in LACKING]


def test_the_folder_holds_page_style_figures_and_data(report: Path) -> None:
    names = set(contents(report))
    assert {"index.html", "style.css"} <= names
    for figure in DRAWN:
        assert {f"figures/{figure.name}.svg", f"figures/{figure.name}-dark.svg", f"data/{figure.name}.csv"} <= names
    assert not [name for name in names if name.endswith(".tmp")]


def test_every_link_of_the_page_leads_to_a_file_or_an_anchor(report: Path, page: Page) -> None:
    anchors = {attributes["id"] for _, attributes in page.elements if "id" in attributes}
    for _, attributes in page.elements:
        for key in ("href", "src", "srcset"):
            target = attributes.get(key)
            if target is None:
                continue
            assert "://" not in target
            assert target[1:] in anchors if target.startswith("#") else (report / target).is_file()


def test_the_page_runs_no_script_and_needs_no_inline_style(page: Page) -> None:
    tags = {tag for tag, _ in page.elements}
    assert not tags & {"script", "iframe", "object", "embed", "style", "svg", "form"}
    for _, attributes in page.elements:
        assert "style" not in attributes
        assert not [key for key in attributes if key.startswith("on")]


def test_sections_come_in_the_order_of_the_report(page: Page) -> None:
    order = [str(attributes["id"]) for tag, attributes in page.elements if tag == "section"]
    figures = [figure.name for figure in DRAWN if figure.name != "speed"]
    assert order == ["by_target", "code", "verdict", *figures, "claims", "speed", "unmeasured"]
    folded = [attributes["id"] for tag, attributes in page.elements if tag == "details" and "id" in attributes]
    answers = ["verdict_fine", "verdict_float16", "verdict_float64"]
    behind = ["mesh_edges", "census", "hostile", "smoothness", "worst", "formulas", "provenance"]
    assert [name for name in folded if name not in answers] == behind


def test_the_code_of_each_answer_is_what_the_command_writes(page: Page, run: Any) -> None:
    answer = by_target(Rows(run), 1 / 255, "1/255")
    assert isinstance(answer, Table)
    winners = answer.data[["alpha", "name"]].drop_duplicates().to_dict("records")
    content = code(answer)
    assert isinstance(content, CodeList)
    assert [(one.alpha, one.formula) for one in content.winners] == [(w["alpha"], w["name"]) for w in winners]
    assert {language for one in content.winners for language, _ in one.listings} == {*GPU.values(), *PROCESSOR.values()}
    for one in content.winners:
        for language, text in one.listings:
            assert text in page.text
            assert f"phongbench shader {one.formula} --alpha {one.alpha:g} --language {language.lower()}\n" in text
    assert not [name for name in ("open", "onclick") for _, attributes in page.elements if name in attributes]


def test_words_are_explained_beside_the_first_table(page: Page, run: Any) -> None:
    first = page.text.split("The answer by target, within")[2].split("The code")[0]
    for name in ("lyon Lyon", "gcn4 AMD GCN 4", "the shininess", "lambda form", "1/255"):
        assert name in re.sub(r"\s+", " ", first)


def test_a_cell_of_a_stacked_table_carries_its_heading(page: Page) -> None:
    cells = [attributes["data-label"] for attributes in page.all("td") if "data-label" in attributes]
    assert {"target", "α\u00a0=\u00a050", "formula", "runner-up"} <= set(cells)


def test_all_that_a_report_weighs(report: Path) -> None:
    assert sum(map(len, contents(report).values())) < 3_000_000


def test_every_figure_has_alt_text_a_sentence_counts_and_its_csv(page: Page) -> None:
    images = list(page.all("img"))
    assert len(images) == len(DRAWN)
    assert all(len(str(image["alt"])) > 80 for image in images)
    downloads = {link["download"] for link in page.all("a") if "download" in link}
    assert {f"{figure.name}.csv" for figure in DRAWN} <= downloads
    # but for those of angles (error_angle, incidence, copper), lobes (moments, cut), normals, times, and meshes' edges
    assert page.text.count("samples a cell, coverage: sampled") >= len(DRAWN) - 8


def test_same_rows_give_the_same_bytes_in_another_process_in_another_order_and_type(
    report: Path, tmp_path: Path
) -> None:
    # The text of every second table comes as categories there, here as plain strings.
    program = f"""
import sys
from pathlib import Path
sys.path.insert(0, {str(HERE)!r})
import made_up_run
run = made_up_run.make_run(Path("elsewhere"))
frames = [frame.sample(frac=1, random_state=7) for frame in run.frames]
frames[::2] = map(made_up_run.categories, frames[::2])
shuffled = made_up_run.MadeUpRun(run.path, run.manifest, *frames)
import phongbench_reports
phongbench_reports.build(shuffled, Path({str(tmp_path)!r}))
"""
    environment = {**os.environ, "PYTHONHASHSEED": "12345", "TZ": "Asia/Tokyo", "LC_ALL": "C"}
    subprocess.run([sys.executable, "-c", program], check=True, env=environment)
    first, second = contents(report), contents(tmp_path)
    assert list(first) == list(second)
    assert [name for name in first if first[name] != second[name]] == []


def test_a_figure_carries_no_date_and_keeps_text_as_text(report: Path) -> None:
    for name, content in contents(report).items():
        if name.endswith(".svg"):
            text = content.decode("utf-8")
            assert "<text" in text
            assert not re.search(r"dc:date|20\d\d-\d\d-\d\dT", text)


def test_light_and_dark_differ_in_colours_only(report: Path) -> None:
    for figure in DRAWN:
        light = (report / "figures" / f"{figure.name}.svg").read_text(encoding="utf-8")
        dark = (report / "figures" / f"{figure.name}-dark.svg").read_text(encoding="utf-8")
        assert light != dark
        assert re.sub("#[0-9a-f]{6}", "#", light) == re.sub("#[0-9a-f]{6}", "#", dark)


def test_a_run_named_script_is_inert(made_up: Callable[..., Any], tmp_path: Path) -> None:
    evil = made_up(tmp_path, name='<script>alert("x")</script>', alphas=(50.0,), gammas=(8,), precisions=("float32",))
    name = "<img src=x onerror=alert(1)>"
    for frame in (evil.accuracy, evil.timing, evil.worst):
        frame["approximation"] = frame["approximation"].replace("schlick", name)
    evil.manifest["provenance"]["host"] = "</code><script>1</script>"
    index = phongbench_reports.build(evil, tmp_path / "report")
    parsed = Page(index.read_text(encoding="utf-8"))
    assert "script" not in {tag for tag, _ in parsed.elements}
    assert name in parsed.text
    assert '<script>alert("x")</script>' in parsed.text
    assert re.search(r"\b1\s+exponent\n", parsed.text)  # one of a thing is told in the singular
    assert not re.search(r"\b1\s+(exponents|formulas)\b", parsed.text)
    for path in (tmp_path / "report" / "figures").iterdir():
        assert "<img" not in path.read_text(encoding="utf-8")


def test_the_single_file_holds_everything_and_may_be_named(
    run: Any, report: Path, as_drawn: Callable[[], AbstractContextManager[None]], tmp_path: Path
) -> None:
    with as_drawn():
        index = phongbench_reports.build(run, tmp_path / "new" / "mine.html", single_file=True)
    assert index == tmp_path / "new" / "mine.html"
    assert contents(tmp_path / "new").keys() == {"mine.html"}
    parsed = Page(index.read_text(encoding="utf-8"))
    assert [tag for tag, _ in parsed.elements].count("style") == 1
    assert not list(parsed.all("link"))
    for _, attributes in parsed.elements:
        for key in ("href", "src", "srcset"):
            assert (attributes.get(key) or "#").startswith(("#", "data:"))
    assert (
        Page((report / "index.html").read_text(encoding="utf-8")).text.split()
        == re.sub(re.escape((report / "style.css").read_text(encoding="utf-8")), "", parsed.text).split()
    )


def test_a_single_file_without_a_name_is_the_index_of_its_folder(
    tmp_path: Path, made_up: Callable[..., Any], only_figures: Callable[..., AbstractContextManager[None]]
) -> None:
    small = made_up(tmp_path / "run", alphas=(50.0,), gammas=(8,), precisions=("float32",))
    with only_figures():
        page = phongbench_reports.build(small, tmp_path / "new", single_file=True)
    assert page == tmp_path / "new" / "index.html"
    assert contents(tmp_path / "new").keys() == {"index.html"}


def test_an_unwritable_folder_is_told_in_words(made_up: Callable[..., Any], tmp_path: Path) -> None:
    (tmp_path / "taken").write_text("a file where the folder should be", encoding="utf-8")
    small = made_up(tmp_path / "run", alphas=(50.0,), gammas=(8,), precisions=("float32",))
    with pytest.raises(InputError, match="cannot write"):
        phongbench_reports.build(small, tmp_path / "taken")


def test_files_are_readable_by_others_like_any_file(report: Path) -> None:
    plain = report / "plain"
    plain.touch()
    expected = stat.S_IMODE(plain.stat().st_mode)
    plain.unlink()
    assert {stat.S_IMODE((report / name).stat().st_mode) for name in contents(report)} == {expected}


def test_sections_without_rows_say_so_and_how_to_get_them(
    made_up: Callable[..., Any], report: Path, tmp_path: Path
) -> None:
    full = made_up(tmp_path, alphas=(10.0, 50.0), gammas=(4, 8), precisions=("float32",))
    shutil.copytree(report, tmp_path / "report")  # what a fuller run left there
    accuracy = full.accuracy[full.accuracy["stratum"] == "highlight"]
    bare = type(full)(full.path, full.manifest, accuracy, full.timing.iloc[:0], full.worst.iloc[:0])
    index = phongbench_reports.build(bare, tmp_path / "report")
    text = Page(index.read_text(encoding="utf-8")).text
    assert "not what is cheapest" in text
    lacking = text.split("What was not measured")[-1]
    assert re.search(r"Error against time.*: This run has no timing, so there is no front\. Run again without", lacking)
    assert "This run kept no worst inputs" in lacking
    assert "The run holds no lyon rows on vectors of the wrong length" in lacking
    assert not {"front", "worst", "stability"} & {attributes.get("id") for _, attributes in page_of(index).elements}
    assert "Inputs of the strata" in text
    left = set(contents(tmp_path / "report"))
    assert not {"figures/front.svg", "figures/speed-dark.svg", "data/worst.csv"} & left


def test_a_run_of_one_foreign_formula_still_makes_a_page(made_up: Callable[..., Any], tmp_path: Path) -> None:
    full = made_up(tmp_path, alphas=(50.0,), gammas=(8,), precisions=("float16",))
    frames = [f.replace({"approximation": {"schlick": "mine"}}) for f in (full.accuracy, full.timing, full.worst)]
    only = [frame[frame["approximation"].isin(["mine"])] for frame in frames]
    index = phongbench_reports.build(type(full)(full.path, full.manifest, *only), tmp_path / "report")
    assert "mine" in Page(index.read_text(encoding="utf-8")).text


@pytest.mark.usefixtures("blank_figures")
def test_float64_whose_rounding_was_not_measured_makes_a_page(made_up: Callable[..., Any], tmp_path: Path) -> None:
    found = made_up(tmp_path / "run", alphas=(10.0, 50.0), gammas=(8, 32), precisions=("float32", "float64"))
    found.accuracy.loc[found.accuracy["precision"] == "float64", "rounding_max"] = float("nan")
    text = phongbench_reports.build(found, tmp_path / "report").read_text(encoding="utf-8")
    assert not re.search(r"\bnan\b", text.lower())
