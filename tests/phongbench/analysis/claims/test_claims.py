"""All claims: on rows of the real engine, in any order, as JSON, and refused where rows are missing."""

import json
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from claim_tables import CODE, Tables, accuracy, judged

from phongbench.analysis import claims
from phongbench.analysis.claims import CLAIMS, VERDICTS, answer, judge
from phongbench.analysis.claims.claim import LackingRowsError, plain
from phongbench.analysis.claims.words import BRIEF, brief, codes, exponents, listed, rounded, times
from phongbench.analysis.rows import Rows
from phongbench.errors import CorruptRunError, InputError
from phongbench.formulas.lambda_forms import LAMBDA_FORMS
from phongbench.inputs.plan import preset
from phongbench.results.runs import Run
from phongbench.results.schema import TABLES


def test_claims_are_lettered_in_order_and_describe_themselves() -> None:
    assert [claim.key for claim in CLAIMS] == list("abcdefghijklmno")
    for claim in CLAIMS:
        assert len(claim.rule_text) > 80
        assert claim.title
        assert not claim.title.endswith(".")
        assert set(claim.needs) <= set(TABLES)


def test_without_scenes_a_claim_says_what_would_measure_it() -> None:
    for key in "fil":
        found = judged(key, accuracy=accuracy([{}]))
        assert found["verdict"] == "not measured"
    for key in "il":
        assert "--scenes" in judged(key, accuracy=accuracy([{}]))["lacking"]


def test_a_run_without_any_of_the_rows_is_refused_with_the_command() -> None:
    with pytest.raises(InputError, match="phongbench run") as refused:
        judge(Tables())
    assert "not timed" in refused.value.what


@pytest.fixture(scope="module")
def engine_rows(swept: Callable[..., pd.DataFrame]) -> pd.DataFrame:
    """Rows of the real engine that every accuracy rule of this issue reads."""
    plan = replace(
        preset("quick"),
        alphas=(10.0, 64.0, 200.0),
        gammas=(4, 8, 64),
        spaces=("reflect", "half"),
        approximations=("phong", "lyon", "gaussian", "blinn"),
        precisions=("float32",),
        strata=("highlight", "lengths"),
        lambda_forms=tuple(f for f in LAMBDA_FORMS if f != "tan2"),
        samples=4096,
        timing=False,
    ).validated()
    return swept(plan)


def test_every_rule_judges_the_rows_of_the_engine(engine_rows: pd.DataFrame) -> None:
    found = {one.claim.key: one.as_dict() for one in judge(Tables(accuracy=engine_rows))}
    assert list(found) == list("abcdefghijklmno")
    for key in "ab":  # met at one exponent of three
        assert found[key]["verdict"] == "fails mostly"
    for key in "cegj":
        assert found[key]["verdict"] == "holds under conditions"
    for one in found.values():
        assert 0 < len(one["brief"].split()) <= BRIEF
    assert found["a"]["conditions"][0]["gamma"] == 8
    limits = {one["alpha"]: one for one in found["b"]["conditions"] if one["lambda_form"] == "dot"}
    assert [limits[alpha]["within"] for alpha in (10.0, 64.0, 200.0)] == ["never", "in passing", "from some gamma on"]
    assert limits[64.0]["gammas_within"] == [64]
    assert {one["verdict"] for one in found.values()} <= set(VERDICTS)


def test_evidence_names_rows_of_the_run(engine_rows: pd.DataFrame) -> None:
    tables = Tables(accuracy=engine_rows)
    for one in judge(tables):
        for row in one.finding.evidence:
            table = getattr(tables, row["table"])
            mask = pd.Series(True, index=table.index)
            for column in TABLES[row["table"]].key:
                mask &= table[column].isna() if row[column] is None else (table[column] == row[column]).fillna(False)
            assert table.loc[mask, row["column"]].tolist() == [row["value"]]


def test_the_same_rows_give_the_same_bytes_in_any_order(engine_rows: pd.DataFrame) -> None:
    def told(rows: pd.DataFrame) -> str:
        return json.dumps([one.as_dict() for one in judge(Tables(accuracy=rows))], allow_nan=False)

    once = told(engine_rows)
    assert told(engine_rows.sample(frac=1.0, random_state=1)) == once
    categories = dict.fromkeys(["approximation", "lambda_form", "perturbation", "stratum", "coverage"], "category")
    assert told(engine_rows.astype(categories)) == once


def test_the_answer_of_a_stored_run_is_strict_json(stored: Callable[..., Run]) -> None:
    found = answer(stored())
    assert json.loads(json.dumps(found, allow_nan=False)) == found
    assert found["run"] == "20260101-000000-0123abcd"
    assert {claim["key"] for claim in found["claims"]} == set("abcdefghijklmno")


def test_a_stored_run_that_is_partial_or_changed_is_refused(stored: Callable[..., Run]) -> None:
    with pytest.raises(InputError, match="--resume"):
        answer(stored("20260101-000000-0123abcd", state="partial"))
    run = stored("20260102-000000-0123abcd")
    path = run.path / "accuracy.parquet"
    path.write_bytes(path.read_bytes()[:-1] + b"?")
    with pytest.raises(CorruptRunError, match="bytes have changed"):
        answer(run)


def test_a_rule_that_lacks_rows_is_an_input_error_with_a_mend() -> None:
    with pytest.raises(LackingRowsError) as lacking:
        claims.CLAIMS[0].rule(Rows(Tables()))
    assert isinstance(lacking.value, InputError)
    assert "phongbench run" in str(lacking.value.fix)


def test_plain_data_has_neither_numpy_nor_what_json_lacks() -> None:
    found = plain({"a": (np.float64("inf"), np.int64(2), pd.NA), 1: [float("nan"), None, "x"]})
    assert found == {"a": [None, 2, None], "1": [None, None, "x"]}
    assert type(found["a"][1]) is int


def test_exponents_are_told_as_all_a_range_or_a_list() -> None:
    measured = [5.0, 10.0, 20.0, 50.0, 100.0]
    assert exponents(measured, measured) == "every exponent (5 .. 100)"
    assert exponents(measured[1:4], measured) == "alpha 10 .. 50"
    assert exponents([5.0, 20.0, 100.0], measured) == "alpha 5, 20 and 100"
    assert exponents([5.0], measured) == "alpha 5"
    assert exponents([], measured) == "none of the 5 exponents"
    assert listed([]) == "none"
    assert [times(ratio) for ratio in (0.97, 3.56, 164.2, 2e9)] == ["0.97", "3.6", "160", "over a million"]
    assert (codes(CODE), codes(0.1), rounded(63779.6)) == ("1 code", "26 codes", "63,800")


@pytest.mark.parametrize(
    ("because", "told"),
    [
        ("One holds at alpha 10 .. 100; two do not. Three do.", "One holds at alpha 10 .. 100; two do not; Three do."),
        (f"{'word ' * 24}(and more in brackets); rest.", f"{'word ' * 23}word."),
        (f"First. Second{' word' * 30}.", "First."),
    ],
)
def test_a_reason_in_brief_is_its_first_clauses(because: str, told: str) -> None:
    assert brief(because) == told


def test_two_exponents_judge_no_claim_about_exponents(engine_rows: pd.DataFrame) -> None:
    few = engine_rows[engine_rows["alpha"] != 64.0]
    found = {one.claim.key: one.as_dict() for one in judge(Tables(accuracy=few))}
    for key in "abceg":
        assert found[key]["verdict"] == "not measured"
        assert found[key]["because"].startswith("2 exponents are too few to judge this by; by what was measured it ")
        assert found[key]["conditions"]
        assert "phongbench run" in found[key]["lacking"]
    gammas = engine_rows[engine_rows["gamma"].isin([4, 8]) | engine_rows["gamma"].isna()]
    found = {one.claim.key: one.verdict for one in judge(Tables(accuracy=gammas))}
    assert (found["a"], found["b"]) == ("fails mostly", "not measured")  # by two gammas
