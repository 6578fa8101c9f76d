"""The answer as code: at each exponent the winner of each target, in the languages that such targets take."""

from contextlib import suppress
from dataclasses import dataclass

from phongbench.analysis.by_target import PRECISION
from phongbench.analysis.ready_code import ready_code
from phongbench.errors import PhongbenchError
from phongbench.formulas.formula import Formula
from phongbench.formulas.shader_code.export import Options
from phongbench.formulas.shader_code.languages import LANGUAGES
from phongbench.formulas.user_files import installed
from phongbench.results.schema import CPU
from phongbench.targets.chips import TARGETS
from phongbench_reports.table import Absent, Table
from phongbench_reports.text import listed

#: languages of GPUs, and of all other targets, as they are called
GPU = {"glsl": "GLSL", "hlsl": "HLSL", "wgsl": "WGSL"}
PROCESSOR = {"c": "C", "numpy": "NumPy"}


@dataclass(frozen=True)
class Winner:
    """A formula that is the answer at an exponent somewhere.

    alpha     exponent
    formula   its spelling
    where     the targets on which it wins: "cpu and cortex-m7"
    listings  (language, source), as `phongbench shader` writes it
    """

    alpha: float
    formula: str
    where: str
    listings: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class CodeList:
    """The section's content: winners by exponent, and of each exponent in the order of the targets."""

    winners: tuple[Winner, ...]
    takeaway: str
    basis: str


def code(answer: Table | Absent) -> CodeList | Absent:
    """The code of every answer of the table by target; a formula that only its user's run knew has none."""
    if isinstance(answer, Absent):
        return answer
    named = answer.data[answer.data["name"].notna()]
    winners = (
        _winner(str(name), float(str(alpha)), rows["target"].tolist())
        for (alpha, name), rows in named.groupby(["alpha", "name"], sort=False)
    )
    written = tuple(winner for winner in winners if winner.listings)
    if not written:
        return Absent("No formula of this run is within the budget and known here.", "Name your own with --with.")
    languages = listed([*GPU.values(), *PROCESSOR.values()])
    return CodeList(
        written,
        f"The answers as code to paste: {languages}, each where it is of use.",
        f"{PRECISION}; the comment at the top of each tells its error and the command that writes it again",
    )


def _winner(name: str, alpha: float, targets: list[str]) -> Winner:
    gpu = {LANGUAGES[TARGETS[target].language].gpu if target in TARGETS else target != CPU for target in targets}
    languages = (GPU if True in gpu else {}) | (PROCESSOR if False in gpu else {})
    registry, listings = installed(), []
    with suppress(PhongbenchError):  # of a user's file that is not at hand, or that has no spelling in a language
        formula = Formula.parse(name, registry)
        for language, title in languages.items():
            listings.append((title, ready_code(formula, alpha, Options(language), registry).text))
    return Winner(alpha, name, listed(targets), tuple(listings))
