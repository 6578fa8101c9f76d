"""What to ship for each material of an MTL file: the answer of `recommend` at its exponent."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from phongbench.analysis.recommend import recommend
from phongbench.errors import InputError
from phongbench.inputs.mtl_files import read_mtl
from phongbench.results.runs import Run

#: so many materials without a highlight are named
NAMED = 3


def for_materials(run: Run | None, file: Path, targets: Sequence[str], **question: Any) -> dict[str, Any]:
    """Answers for the materials that have a highlight, as plain data.

    targets    where the formulas will run
    question   the other arguments of `recommend`
    materials  for each target, and each material in the order of the file: material, its name, and the answer, which
               materials of one exponent share. An exponent that the run did not measure has no choices, and says so as
               its verdict
    notes      what is odd in the file, and which materials have no highlight
    Raises InputError where no material has a positive Ns, and what `recommend` raises of the rest of the question.
    """
    read = read_mtl(file)
    shiny = [material for material in read.materials if material.shininess > 0]
    if not shiny:
        raise InputError("no material has a positive Ns", str(file), "an MTL material needs a line like: Ns 96.08")
    known: dict[tuple[str, float], dict[str, Any]] = {}
    problems: list[InputError] = []
    for target in targets:
        for alpha in dict.fromkeys(material.shininess for material in shiny):
            try:
                known[target, alpha] = recommend(run, alpha=alpha, target=target, **question)
            except InputError as problem:
                problems.append(problem)
                known[target, alpha] = _unanswered(alpha, target, problem, file, question)
    if len(problems) == len(known):
        raise problems[0]
    answers = [{"material": one.name, **known[target, one.shininess]} for target in targets for one in shiny]
    dull = [material.name for material in read.materials if not material.shininess > 0]
    return {"materials": answers, "notes": [*read.notes, *_left_out(file, dull)]}


def _left_out(file: Path, names: Sequence[str]) -> list[str]:
    """A note on materials without a highlight, a few of them by name; nothing where there are none."""
    more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
    return [f"{file}: no highlight, for want of a positive Ns: {', '.join(names[:NAMED])}{more}"] if names else []


def _unanswered(alpha: float, target: str, problem: InputError, file: Path, question: dict[str, Any]) -> dict[str, Any]:
    """An answer that chooses nothing, for an exponent that the run says nothing about."""
    return {
        "alpha": f"{alpha:.10g}",
        "target": target,
        "precision": question.get("precision", "float32"),
        "length_error": None,
        "choices": [],
        "nearest_miss": None,
        "verdict": problem.what,
        "notes": [f"alpha {alpha:g} has no answer: {problem.what}; phongbench run --materials {file} measures all"],
    }
