"""How coarse a mesh may be at each exponent before normals that are left raw show by one 8-bit code."""

from itertools import product

import pandas as pd

from phongbench.analysis.mesh_edges import PAIRS, in_words, reaches
from phongbench.analysis.rows import Rows
from phongbench.formulas.lambda_forms import LAMBDA_FORMS
from phongbench.results.records import Records
from phongbench_reports.figures.meshes import LOOKS
from phongbench_reports.table import Absent, Table
from phongbench_reports.text import alpha_is, gamma_is, records, span

#: kind of pair -> a short name
WAYS = {"classic": "classic R", "lengthwise": "lengthwise R", "half": "(N,\u00a0H)"}


def mesh_edges(study: Rows) -> Table | Absent:
    """A row per exponent, a column per way to make the pair and lambda form: the widest edge within one code."""
    found = reaches(Records.of(study.lyon_meshes))
    if not found:
        return Absent("The run holds no lyon rows on interpolated normals.", "Run with --probe meshes.")
    data = pd.DataFrame(found)
    forms = [form for form in LAMBDA_FORMS if (data["lambda_form"] == form).any()]
    columns = [
        way for way in product(PAIRS, forms) if ((data["pair"] == way[0]) & (data["lambda_form"] == way[1])).any()
    ]
    edges = {
        (row["alpha"], row["pair"], row["lambda_form"]): in_words(row["degrees"], row["relation"]) for row in found
    }
    rows = tuple(
        (f"{alpha:g}", *(edges.get((alpha, *way), "–") for way in columns)) for alpha in sorted(data["alpha"].unique())
    )
    headings = ("α", *(f"{WAYS[pair]} · {form}" for pair, form in columns))
    samples = f"{span(study.lyon_meshes['samples'])} samples a cell and edge"
    lyon = f"lyon, {gamma_is(data['gamma'].iloc[0])}, float32"
    basis = f"{lyon}, on every mesh; {samples}; between two measured edges along a power law"
    return Table(headings, rows, data, _sentence(data), basis, frozenset(range(len(headings))))


def _sentence(data: pd.DataFrame) -> str:
    """The way that bears the widest edges, and the one that bears the narrowest, over all exponents."""
    worst = data.sort_values(["degrees", "alpha"], kind="stable").drop_duplicates(["pair", "lambda_form"])
    words = [
        f"{WAYS[row['pair']]} in the form {row['lambda_form']} ({in_words(row['degrees'], row['relation'])} at "
        f"{alpha_is(row['alpha'])})"
        for row in records(worst)
    ]
    ways = "; ".join(f"{name}: {LOOKS[pair][0]}" for pair, name in WAYS.items() if name != LOOKS[pair][0])
    return (
        f"Normals left raw change the highlight by at most one 8-bit code up to these edges. At the exponent that is "
        f"worst for each, {words[-1]} bears the widest, {words[0]} the narrowest. {ways[:1].upper()}{ways[1:]}."
    )
