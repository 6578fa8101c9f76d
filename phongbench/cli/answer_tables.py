"""The answers of a run as people read them: fronts, recommendations, claims."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import click

from phongbench.cli.layout import command, say, table

#: how sure the intervals of times are
LEVEL = "99 % interval"
#: precisions that code is written in
SHADERS = ("float32", "float16")


def front_table(answer: Mapping[str, Any], *, everything: bool = False) -> None:
    """A front as a table, fastest first; what is off it is only counted, unless everything is requested."""
    points = answer["points"]
    shown = [p for p in points if everything or p["state"] != "off"]
    compiled, here = answer["cost_kind"] == "compiled", answer["target"] == "cpu"
    costs = [(p["cost"], p["bound_by"]) if compiled else (interval(p), p["ns"]) for p in shown]
    rows = [
        (p["name"], p["error"], 255 * p["error"], p["ratio"], *cost, p["state"])
        for p, cost in zip(shown, costs, strict=True)
    ]
    title = f"{answer['stratum']} vectors, {answer['precision']}, {answer['space']} space, alpha {answer['alpha']}"
    kinds = ("cost / exact Phong", "cost", "bound by") if compiled else ("time / exact Phong", LEVEL, "ns")
    columns = ("formula", answer["metric"], "8-bit codes", *kinds, "state")
    table(title, columns, rows, right=columns[1:6])
    _front_notes(answer, compiled=compiled, here=here)
    counted = Counter(p["state"] for p in points)
    close = f", {counted['unresolved']} too close to call" if counted["unresolved"] else ""
    hidden = "" if len(shown) == len(points) else "; --all shows them"
    say(f"{counted['on']} of {len(points)} are on the front{close}, {counted['off']} off it{hidden}", err=True)


def _front_notes(answer: Mapping[str, Any], *, compiled: bool, here: bool) -> None:
    notes = ["errors were measured, and are lower bounds: nothing is promised of them; `recommend` proves bounds"]
    if compiled:
        notes.append(f"errors: of run {answer['run']}; costs: beyond the dot product on {answer['target']}, compiled")
    else:
        times = f"working set {answer['working_set']}, of run {answer['run']}"
        notes.append(f"times: {times if here else 'as measured on ' + answer['target']}")
    notes += [f"note: {note}" for note in answer["notes"]]
    if not answer["same_machine"] and here:
        notes.append(
            "the run was timed on another kind of machine: its ratios hold there, its nanoseconds are left out"
        )
    if len(answer["alphas"]) > 1:
        listed = ", ".join(f"{alpha:g}" for alpha in answer["alphas"])
        notes.append(f"error: the worst at alpha {listed}, the run's in that range")
    if answer["timed_precision"] != answer["precision"] and here:
        notes.append(f"{answer['precision']} is emulated and not timed: times are those of {answer['timed_precision']}")
    for note in notes:
        say(note, err=True)


def target_answers(answers: Sequence[Mapping[str, Any]]) -> None:
    """The cheapest formula within one 8-bit code at each exponent on each target."""
    rows = []
    for a in answers:
        codes, name = _codes(a["bound"]), a["name"] or "nothing fits"
        rows.append((f"{a['alpha']:g}", a["target"], name, codes, a["ratio"], _spread(a), a["bound_by"]))
    columns = ("alpha", "target", "formula", "8-bit codes", "/ exact Phong", f"cost or {LEVEL}", "bound by")
    table("Cheapest within one 8-bit code, float32, unit vectors", columns, rows, right=columns[3:6])


def recommendation(answer: Mapping[str, Any]) -> None:
    """The answer to a budget: a sentence, a table of choices, each one's reason, then what to bear in mind."""
    miss, choices = answer["nearest_miss"], answer["choices"]
    named = [*zip(("best", "next"), choices, strict=False), *([("nearest miss", miss)] if miss else [])]
    rows = [
        (role, c["name"], c["beta"], c["bound"], _codes(c["bound"]), c["coverage"], c["ratio"], _spread(c))
        for role, c in named
    ]
    target = answer.get("target", "cpu")
    where = "" if target == "cpu" else f", {target}"
    title = f"Largest error at most {answer['max_error']:.4g} at alpha {answer['alpha']}, {answer['precision']}{where}"
    counted = any(choice["cost_kind"] == "compiled" for _, choice in named)
    heads = ("cost / exact Phong", "cost") if counted else ("time / exact Phong", LEVEL)
    columns = ("", "formula", "beta", "at most", "8-bit codes", "coverage", *heads)
    table(title, columns, rows, right=columns[2:5] + columns[6:])
    say(answer["verdict"])
    for role, choice in named:
        say(f"{role}: {choice['why']}")
    if answer.get("steps"):
        _steps(answer)
    for note in answer["notes"]:
        say(f"note: {note}")
    for line in _elsewhere(answer.get("elsewhere", ())):
        say(line)
    _as_code(answer)
    say(f"from {answer['run']}" if answer["run"] else "from the laws, without a run")


def _as_code(answer: Mapping[str, Any]) -> None:
    """The commands that write the choice as code: one for each exponent."""
    if answer["choices"] and answer["precision"] in SHADERS:
        name = answer["choices"][0]["name"]
        if ".." in answer["alpha"]:
            command(shader_command(name, "A", answer), f"for an exponent A in {answer['alpha']}: ")
            return
        for alpha in answer["alpha"].split(", "):
            command(shader_command(name, alpha, answer), "as code: ")


def shader_command(name: str, alpha: str, answer: Mapping[str, Any]) -> str:
    """The words that write a formula as code, on the vectors and in the precision that an answer is about."""
    words = ["phongbench shader", name, "--alpha", alpha]
    if answer["precision"] == "float16":
        words += ["--precision", "float16"]
    if answer.get("length_error"):
        words += ["--length-error", f"{answer['length_error']:.4g}"]
    return " ".join(words)


def material_table(document: Mapping[str, Any]) -> None:
    """The choice for each material, then what is not as usual, then the commands that write the code of each."""
    answers = document["materials"]
    several = len({answer["target"] for answer in answers}) > 1
    rows = []
    for answer in answers:
        best = answer["choices"][0] if answer["choices"] else None
        cells = (best["name"], _codes(best["bound"]), best["ratio"], _spread(best)) if best else ("-", "", "", "")
        target = (answer["target"],) if several else ()
        remark = "" if best and answer["verdict"].startswith(f"{best['name']}: ") else answer["verdict"]
        rows.append((answer["material"], *target, answer["alpha"], *cells, remark))
    where = ("target",) if several else ()
    heads = ("material", *where, "alpha", "formula", "8-bit codes", "/ exact Phong", f"cost or {LEVEL}", "")
    table(f"Within the budget, {answers[0]['precision']}", heads, rows, right=("alpha", *heads[-4:-1]))
    said = dict.fromkeys(note for answer in answers for note in answer["notes"])
    for note in said:
        say(f"note: {note}", err=True)
    chosen = {(a["choices"][0]["name"], a["alpha"]): a for a in answers if a["choices"]}
    for (name, alpha), answer in chosen.items():
        command(shader_command(name, alpha, answer), "as code: ")


def print_codes(answers: Iterable[Mapping[str, Any]]) -> None:
    """The code of each choice at each exponent, once."""
    for text in dict.fromkeys(code["code"] for answer in answers for code in answer["codes"]):
        click.echo(f"\n{text.rstrip()}")


def _elsewhere(others: Iterable[Mapping[str, Any]]) -> list[str]:
    """A line for each other answer, with all the targets that give it."""
    lines: dict[str, list[str]] = {}
    for other in others:
        cost = f"{other['cost']:.3g} {other['unit']} beyond the dot product, {other['ratio']:.3g} of exact Phong's"
        line = f"{other['name']}, {cost}; error {other['max_abs']:.3g}"
        lines.setdefault(line, []).append(other["target"])
    return [f"on {', '.join(targets)}: {line}" for line, targets in lines.items()]


def _steps(answer: Mapping[str, Any]) -> None:
    """What each step of a highlight from raw vectors costs, and the recipe that normalises everything."""
    if usual := answer["usual"]:
        cost = f"{usual['ratio']:.3g} of exact Phong's time"
        say(f"to compare: {usual['name']}, which normalises everything, takes {cost}")
    rows = [
        (s["step"], s["what"], s["ns"], s["share"], f"{s['share_low']:.2g} .. {s['share_high']:.2g}")
        for s in answer["steps"]
    ]
    columns = ("step", "", "ns", "share of exact Phong", LEVEL)
    table(f"What each step costs, {answer['working_set']}", columns, rows, right=columns[2:])


def claims_table(answer: Mapping[str, Any], *, verbose: bool = False) -> None:
    """The textbook claims with their verdicts, each with its reason below, or what would measure it.

    verbose  the whole reason of each, instead of its first words
    """
    from phongbench.analysis.claims import SIGNS

    rows = []
    for claim in answer["claims"]:
        lacking = claim["lacking"] or ""
        fix = f"\n{lacking[:1].upper()}{lacking[1:]}" if lacking else ""
        reason = claim["because"] if verbose else claim["brief"]
        rows.append((claim["key"], f"{SIGNS[claim['verdict']]} {claim['verdict']}", f"{claim['claim']}\n{reason}{fix}"))
    table("", ("", "verdict", "claim, and why"), rows)
    counted = Counter(claim["verdict"] for claim in answer["claims"])
    summary = ", ".join(f"{counted[verdict]} {verdict}" for verdict in SIGNS if counted[verdict])
    more = "--json has" if verbose else "--verbose tells all reasons, --json has"
    say(f"of run {answer['run']}: {summary}; {more} the rules, all conditions and the rows that decide", err=True)


def _spread(choice: Mapping[str, Any]) -> str:
    """A time's interval, or the cost that a compiler counted."""
    if choice.get("cost_kind") == "compiled":
        return f"{choice['cost']:.3g} {choice['unit']}"
    return interval(choice)


def _codes(bound: float | None) -> float | None:
    return None if bound is None else 255 * bound


def interval(row: Mapping[str, Any]) -> str:
    """The interval of a ratio, "0.35 .. 0.41"; nothing where there is none."""
    low, high = row["ratio_low"], row["ratio_high"]
    return "" if low is None or high is None else f"{low:.3g} .. {high:.3g}"
