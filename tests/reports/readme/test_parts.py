"""Each generated part says what its rows say."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas as pd
from made_up_measurements import ALARMS, COMPARED, PICTURES, RATES, WALLS, lines_of

from phongbench.analysis.rows import Rows
from phongbench.formulas.formula import Formula
from phongbench_reports.readme import bench_parts, parts, pictures, raw_part, run_parts
from phongbench_reports.readme.fill import of_run
from phongbench_reports.readme.measurements import Goal


def test_the_same_rows_give_the_same_parts(made: Any) -> None:
    assert of_run(made) == of_run(made)


def test_the_words_of_the_glossary_hold_names_of_formulas_and_chips(made: Any) -> None:
    rows = dict(lines_of(run_parts.glossary(Rows(made)).replace("\\|", "/"))[2:])
    assert "`lyon` Lyon" in rows["names"]
    assert "`gcn4` AMD GCN 4" in rows["chips"]
    assert "1/255" in rows["error, code"]


def test_spheres_are_a_small_picture_of_what_their_text_says() -> None:
    content = pictures.spheres()
    assert content[:4] == b"\x89PNG"
    assert len(content) <= parts.LARGEST_PICTURE
    assert f"{pictures.PICTURES}/{pictures.SPHERES}" in pictures.part()


def test_the_verdict_is_the_reports_at_a_few_exponents(made: Any) -> None:
    part = run_parts.verdict(Rows(made))
    headings, _, *rows = lines_of(part)
    assert headings[:2] == ["α", "formula"]
    assert [row[0] for row in rows] == ["10", "20", "50", "128", "200"]
    assert "within 1/255" in part.lower()


def test_the_answer_by_target_names_formulas_as_they_are_typed(made: Any) -> None:
    headings, _, *rows = lines_of(run_parts.by_target(Rows(made)))
    assert headings[0] == "α"
    assert {"cpu", "gcn4", "rdna2"} <= set(headings)
    assert [row[0] for row in rows] == ["10", "20", "50", "128", "200"]
    assert rows[0][1].startswith("`lyon:")
    assert "|" not in run_parts.by_target(Rows(replace(made, costs=made.costs.head(0))))


def test_speed_shows_a_formula_once_and_the_twin(made: Any) -> None:
    part = run_parts.speed(Rows(made))
    names = [row[0] for row in lines_of(part)[2:]]
    assert len(set(names)) == len(names)
    assert {"phong", "schlick", "lyon:cross:8"} <= set(names)
    assert not {"copy", "triad", "dot", "aa-twin"} & set(names)
    assert "A/A twin" in part


RAW_TIMES = {"lyon:cross:8": 0.4, "phong/once": 1.6, "lyon:cross:8@lengthwise": 0.9, "phong@lengthwise/once": 1.0}


def test_raw_vectors_are_answered_for_with_intervals(made: Any) -> None:
    one = made.timing[(made.timing["approximation"] == "schlick") & (made.timing["precision"] == "float32")]
    rows = [
        one.assign(**{n: getattr(f, n) for n in ("approximation", "lambda_form", "gamma", "recipe", "normalise")})
        .assign(ratio=ratio, ratio_low=0.99 * ratio, ratio_high=1.01 * ratio, ns_min=ratio)
        .astype({"gamma": "Int64"})
        for f, ratio in ((Formula.parse(spelling), ratio) for spelling, ratio in RAW_TIMES.items())
    ]
    usual = made.timing.assign(recipe="pair", normalise="none")
    rows_with = Rows(replace(made, timing=pd.concat([usual, *rows], ignore_index=True)))
    part = raw_part.raw_vectors(rows_with)
    headings, _, given, whole = lines_of(part)
    assert headings[3:] == ["ns in L1", "in L1", "in L2", "beyond cache"]
    assert given[:3] == ["given R and V", "`lyon:cross:8`", "`phong/once`"]
    assert given[4] == "0.250 (0.245 to 0.255), faster"
    assert whole[0] == "from N, L and V"
    assert "Is the cross form without normalising faster" in part


def test_raw_vectors_that_were_not_timed_are_said_to_be_so(made: Any) -> None:
    assert "did not time it" in raw_part.raw_vectors(Rows(made))


def test_throughput_and_wall_times_are_told_apart() -> None:
    assert ["phongbench", "510 million", "48.6"] in lines_of(bench_parts.throughput(RATES))
    assert ["cold", "30.0 s", "8.0 s", "2.5 s", "45.0 s"] in lines_of(bench_parts.times(WALLS))


def test_goals_tell_how_long_and_where_it_went() -> None:
    run = "5 cells (1 billion/s); where 58.2 s went: installing and starting 20.0 s, compiling 15.0 s\n run  there\n"
    tests = f"....\n{20 * '='} 5123 passed, 4 skipped in 560.12s (0:09:20) {20 * '='}\n"
    part = bench_parts.goals([Goal("run", 58.4, run), Goal("test", 581.0, tests)], cores=2)
    assert "2 cores" in part
    assert "`make run` took 58 s (installing and starting 20.0 s, compiling 15.0 s)" in part
    assert part.endswith("`make test` took 9.7 minutes (5123 passed, 4 skipped).")
    assert "`make run` took 58 s." in bench_parts.goals([Goal("run", 58.4, "")], cores=2)


def test_the_machine_is_named_and_no_path_or_host(made: Any) -> None:
    part = run_parts.machine(made)
    assert "changed by options" in part
    assert "numba" in part
    assert str(Path.home()) not in part


def test_peers_are_told_as_ratios_and_the_absent_by_name() -> None:
    part = bench_parts.peers(COMPARED)
    assert lines_of(part)[2:] == [["phongbench 1.2", "0.350 ns"], ["numpy 1.2", "4.80 (4.70 to 4.90)"]]
    assert "Absent: jax" in part


def test_false_alarms_are_told_with_what_is_allowed() -> None:
    part = bench_parts.alarms(ALARMS)
    assert lines_of(part)[2] == ["l1", "200", "24", "1", "0.5 %", "0.0138"]
    assert part.endswith("Allowed is 1 %: met.")
    assert bench_parts.alarms([replace(ALARMS[0], resolved=3)]).endswith("not met.")


def test_scenes_are_told_by_what_leaving_out_saves() -> None:
    part = bench_parts.scenes(PICTURES)
    assert lines_of(part)[2] == ["many-lights", "2", "100 ms", "5.00 ×", "2.50 ×", "yes", "0.0200"]


def test_tracers_are_told_with_what_is_compared() -> None:
    part = bench_parts.scenes(PICTURES)
    assert lines_of(part)[-3:] == [
        ["phongbench", "depth 3, shadows", "10 ms", "0.230", "20", "1", "–", "–"],
        ["plain NumPy", "depth 3, shadows", "250 ms", "0.00922", "0.800", "25", "0.1 %", "–"],
        ["mitsuba", "depth 3, shadows", "20 ms", "0.115", "–", "2", "0.2 %", "99.9990 %"],
    ]
    assert "chequerboard at 64x36" in part
    assert "- mitsuba 1.2: what mitsuba does." in part
    assert "- pyvista is absent: not installed; pip install pyvista brings it." in part


def test_claims_are_told_with_verdict_and_reason(made: Any) -> None:
    headings, _, *rows = lines_of(run_parts.claims(made))
    assert headings == ["claim", "verdict", "result"]
    assert rows[0][0].startswith("a) ")
    assert "not measured" not in [row[1] for row in rows]
