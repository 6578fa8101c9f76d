"""What `run` and `merge` print when a study ends, and how its report is drawn."""

import os
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from phongbench.cli.common import ROOT, facts, say

SOME_CELLS_FAILED = 3
#: variable in which `make run` says when it began, in whole seconds since 1970
STARTED = "PHONGBENCH_STARTED"


def build_report(run: Any, folder: Path, reached: Callable[[int, int], None]) -> Path:
    """Draw the report of a run into a folder, in two processes; the page."""
    from phongbench_reports import build

    return build(run, folder, processes=2, progress=reached)


def exit_on_failures(outcome: Any) -> None:
    """Say what failed or is contradicted, and exit with 3 if anything is."""
    for message, count in outcome.failures.items():
        say(f"{count} cells failed: {message}", err=True)
    for violation in outcome.violations:
        say(f"results contradict each other: {violation}", err=True)
    if outcome.failures or outcome.violations:
        sys.exit(SOME_CELLS_FAILED)


def summary(outcome: Any) -> None:
    """The verdict, where the time went, and what to do next."""
    from phongbench.cli.advice import answer_ahead
    from phongbench.cli.runs import summary_of
    from phongbench.cli.verdict_table import next_commands, verdict_table
    from phongbench.results.answering import kept

    run = outcome.run
    # many go on with `show`, which then has its answer
    found = kept(run, ROOT, summary_of, targets=())["verdict"] if run.records("accuracy") else None
    if found:
        verdict_table(found)
    if outcome.finished_before:
        say("the run was finished before: nothing is left to measure")
    else:
        say(_work(outcome))
    facts({"run": str(run.path)} | ({"report": str(outcome.report)} if outcome.report else {}))
    if found:
        here = run.path.parent == ROOT
        words = next_commands(found, "latest" if here else str(run.path))
        if words:  # likewise, in a quarter of the time that it takes later: its proofs and codes were made for the run
            answer_ahead(run, words)


def _work(outcome: Any) -> str:
    """How much was measured, and where the time went; what came before, such as installing, if `make` says when."""
    seconds = dict(outcome.seconds)
    total, compiling = seconds.pop("total"), seconds.pop("compiling")
    rate = outcome.evaluations / max(seconds["accuracy"] - compiling, 1e-9) / 1e9
    parts = {"compiling": compiling, **seconds, "accuracy": seconds["accuracy"] - compiling}
    began = os.environ.get(STARTED, "")
    before = time.time() - float(began) - total if began.isdigit() else 0.0
    if before >= 1:
        total += before
        parts = {"installing and starting": before, **parts}
    spent = ", ".join(f"{name} {value:.1f} s" for name, value in parts.items() if value >= 0.05)
    return (
        f"{outcome.cells:,} cells, {outcome.evaluations / 1e9:.2f} billion evaluations ({rate:.2f} billion/s); "
        f"where {total:.1f} s went: {spent}"
    )
