"""The parts on raw vectors: whether leaving normalising out saves time, by the rows of a run."""

from typing import Any

from phongbench.analysis.normalising_cost import PLACES, answer
from phongbench.analysis.rows import Rows
from phongbench_reports.figures.speed import SETS
from phongbench_reports.readme.markdown import table
from phongbench_reports.text import INTERVAL, number, ratio


def _untimed(told: dict[str, Any]) -> str:
    return f"{told['question']} This run did not time it: that needs lyon with gamma 8 in {told['precision']}."


def raw_vectors(study: Rows) -> str:
    """The question and its answer: for each way to a highlight of raw vectors, the cross form beside exact Phong."""
    told = answer(study)
    if not told["races"]:
        return _untimed(told)
    places = [place for place in PLACES if any(race["working_set"] == place for race in told["races"])]
    ways = dict.fromkeys((race["way"], race["one"], race["other"]) for race in told["races"])
    cells = {(race["way"], race["working_set"]): _cell(race) for race in told["races"]}
    first = {race["way"]: race for race in reversed(told["races"])}
    lines = [
        (way, f"`{one}`", f"`{other}`", _ns(first[way]), *(cells.get((way, place), "–") for place in places))
        for way, one, other in ways
    ]
    headings = ("", "cross", "exact, one root", f"ns {SETS[places[0]]}", *(SETS[place] for place in places))
    shown = table(headings, lines, right=range(3, len(headings)))
    note = f"{told['precision']} on the {told['target']}; time of the cross form over that of exact Phong"
    return f"**{told['question']}**\n\n{shown}\n\n({note}, with the {INTERVAL}s of both joined.)"


def _cell(race: dict[str, Any]) -> str:
    return f"{ratio(race)}, {race['verdict']}"


def _ns(race: dict[str, Any]) -> str:
    """Nanoseconds of both."""
    return f"{number(race['ns'])} and {number(race['other_ns'])}"
