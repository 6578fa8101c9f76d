"""The dictionary of columns: what every table of a run holds, by the schema that runs are written and read by."""

from phongbench.results.schema import TABLES
from phongbench_reports.readme.markdown import table


def columns() -> str:
    """Every table with its columns: type, unit, meaning; those of its key in bold."""
    parts = []
    for name, stored in TABLES.items():
        rows = [
            (f"**{c.name}**" if c.key else c.name, c.kind, c.unit or "–", c.meaning + (" (may be absent)" * c.optional))
            for c in stored.columns
        ]
        parts.append(f"## {name}\n\n{stored.meaning}.\n\n{table(('column', 'type', 'unit', 'meaning'), rows)}")
    return "\n\n".join(parts)
