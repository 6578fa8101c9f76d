"""Rows as evidence for a verdict."""

from typing import Any

import pandas as pd

from phongbench.results.schema import TABLES


def evidence(table: str, column: str, rows: pd.DataFrame) -> tuple[dict[str, Any], ...]:
    """Rows as plain data: their table, their key columns, and the value of the column that decides."""
    keys = [key for key in TABLES[table].key if key in rows.columns]
    records = rows[keys].astype(object).where(rows[keys].notna(), None).to_dict("records")
    return tuple(
        {"table": table, **{str(k): v for k, v in record.items()}, "column": column, "value": value}
        for record, value in zip(records, rows[column].tolist(), strict=True)
    )


def coverage(rows: pd.DataFrame) -> str:
    """How the errors of these rows were found: "sampled", or several words."""
    return ", ".join(sorted(set(rows["coverage"].astype(str))))
