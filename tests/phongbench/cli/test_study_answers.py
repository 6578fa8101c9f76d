"""What a study says when it ends."""

from pathlib import Path
from types import SimpleNamespace

import pytest

from phongbench.cli.study_answers import summary


@pytest.mark.parametrize("finished", [False, True])
def test_a_study_says_what_it_took_or_that_nothing_was_left(capsys: pytest.CaptureFixture[str], finished: bool) -> None:
    run = SimpleNamespace(records=lambda name: (), path=Path("mine"))
    seconds = {"accuracy": 3.0, "compiling": 1.0, "probes": 1.0, "total": 4.0}
    work = {"evaluations": 4e9, "cells": 12, "seconds": seconds}
    summary(SimpleNamespace(run=run, finished_before=finished, report=None, **work))
    said = capsys.readouterr().out
    assert ("nothing is left to measure" in said) == finished
    assert ("12 cells, 4.00 billion evaluations (2.00 billion/s); where " in said) == (not finished)
    assert "run  mine" in said
