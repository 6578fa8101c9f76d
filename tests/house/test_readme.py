"""README, guide and CONTRIBUTING keep their promises: commands and examples that run, numbers that a program wrote."""

import re
import shlex
from collections.abc import Callable
from pathlib import Path

import pytest

from phongbench.cli.main import EXIT_CODES
from phongbench.formulas import approximations
from phongbench.formulas.registry import specs_of
from phongbench.formulas.spec import Approximation
from phongbench.formulas.user_files import load_file
from phongbench.testing import CHECKS
from phongbench_reports.readme import column_parts, parts

ROOT = Path(__file__).resolve().parents[2]
README, CONTRIBUTING = ROOT / "README.md", ROOT / "CONTRIBUTING.md"
GUIDE = sorted((ROOT / "reports" / "docs").glob("*.md"))


def blocks(file: Path, language: str) -> list[str]:
    """The fenced blocks of that language in a Markdown file."""
    return re.findall(rf"^```{language}\n(.*?)^```$", file.read_text(), re.DOTALL | re.MULTILINE)


def commands(program: str, *files: Path) -> list[str]:
    """The commands of that program shown in console blocks."""
    lines = [line for file in files for block in blocks(file, "console") for line in block.splitlines()]
    return [line.removeprefix("$ ") for line in lines if line.startswith(f"$ {program} ")]


@pytest.mark.parametrize("command", sorted(set(commands("make", README, CONTRIBUTING, *GUIDE))))
def test_a_goal_shown_exists(root: Path, command: str) -> None:
    goals = re.findall(r"^([a-z]+):.*## ", (root / "Makefile").read_text(), re.MULTILINE)
    assert shlex.split(command, comments=True)[1] in goals


def test_the_first_commands_are_run_and_test() -> None:
    assert [command.split("#")[0].strip() for command in commands("make", README)[:2]] == ["make run", "make test"]


def test_every_generated_part_is_there_once_and_filled() -> None:
    # An empty part means that `make docs` has not run.
    assert parts.problems(ROOT) == []


def test_the_dictionary_of_columns_is_that_of_the_schema() -> None:
    assert parts.parts_of(parts.read(ROOT))["columns"] == column_parts.columns()


def test_the_readme_is_read_in_a_few_minutes() -> None:
    assert len(README.read_text().splitlines()) <= 170


@pytest.mark.parametrize("file", [README, *GUIDE], ids=lambda file: file.name)
def test_no_sentence_is_longer_than_thirty_words(file: Path) -> None:
    marked = re.sub(r"<!-- generated: (\w+) -->.*?<!-- /generated: \1 -->", "", file.read_text(), flags=re.DOTALL)
    told = re.sub(r"^```.*?^```$|^\|.*?$|^#.*?$", "\n", marked, flags=re.DOTALL | re.MULTILINE)
    plain = re.sub(r"`[^`]*`", "code", re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", told))
    parts = [" ".join(part.split()) for part in re.split(r"\n\s*\n|\n(?=[-*] )", plain)]
    sentences = [sentence for part in parts for sentence in re.split(r"(?<=[.!?])\s+", part)]
    assert [one for one in sentences if len(re.findall(r"\S*\w\S*", one)) > 30] == []


def test_the_first_screen_of_the_readme_uses_words_that_it_explains() -> None:
    first, rest = README.read_text().split("## Quick start")
    glossary = rest.split("## Glossary")[1].split("\n## ")[0]
    rows = re.findall(r"^\| (.*?) \| (.*?) \|$", glossary, re.MULTILINE)
    explained = set(
        re.findall(r"[\w-]+", " ".join(f"{word} {' '.join(re.findall('`([^`]*)`', told))}" for word, told in rows))
    )
    table = first.split("<!-- generated: targets -->")[1].split("\n\n")[1]
    formulas = {
        part for spelling in re.findall(r"`([^`]+)`", table) for part in spelling.split(":") if not part.isdigit()
    }
    targets = {name.strip() for name in table.splitlines()[0].strip("| ").split("|")[1:]}
    words = {"α", "alpha", "exact", "Phong", "error", "code", "cost", "target", "slope", "beta", "form"}
    assert formulas
    assert targets
    assert (formulas | targets | words) - explained == set()


def test_every_page_of_the_guide_is_named_in_the_readme() -> None:
    assert [page.name for page in GUIDE if f"(reports/docs/{page.name}" not in README.read_text()] == []


@pytest.mark.parametrize("file", [README, CONTRIBUTING, *GUIDE], ids=lambda file: file.name)
def test_every_link_into_the_repository_leads_to_a_file_and_a_heading(file: Path) -> None:
    for target, anchor in re.findall(r"\]\((?!https?:)([^)#\s]*)#?([^)\s]*)\)", file.read_text()):
        page = file.parent / target if target else file
        assert page.exists(), target
        if anchor:
            headings = re.findall(r"^#+ (.*)$", page.read_text(), re.MULTILINE)
            assert anchor in [heading.lower().replace(" ", "-") for heading in headings]


def test_the_table_of_exit_codes_is_that_of_the_command() -> None:
    told = {int(code) for code in re.findall(r"^\| (\d+) \|", README.read_text().split("| exit code |")[1], re.M)}
    assert told == {0, 1, 3, 130} | {code for _, code in EXIT_CODES}


# the examples, run


@pytest.fixture
def rational(tmp_path: Path) -> Path:
    """The file shown in CONTRIBUTING, in a folder of its own."""
    file = tmp_path / "rational.py"
    file.write_text(blocks(CONTRIBUTING, "python")[0])
    return file


@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__.removeprefix("check_"))
def test_the_example_of_contributing_passes_every_check(rational: Path, check: Callable[[Approximation], None]) -> None:
    (spec,) = load_file(rational)
    check(spec)


def test_the_example_of_contributing_is_taken_as_one_of_ours(rational: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # One file in the folder and one name in FAMILIES: the rest is what the package does with each of its own.
    monkeypatch.setattr(approximations, "__path__", [*approximations.__path__, str(rational.parent)])
    (spec,) = specs_of("rational")
    assert spec.name == "rational"
    assert spec.kernel.__module__ == "phongbench.formulas.approximations.rational"
