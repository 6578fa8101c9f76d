"""What moved between two performance ledgers of one machine: ratios of ratios, as for the times of two runs."""

import math
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from phongbench.analysis.compare_times import LEVEL, UNRESOLVED, change
from phongbench.errors import InputError
from phongbench.results.ledgers import Entry, Ledger
from phongbench.timing.statistics import Interval


def compare_ledgers(before: Ledger, after: Ledger, second: str = "B") -> dict[str, Any]:
    """The entries that both ledgers have, as plain data; what moved comes first, the largest change first.

    second  what errors call the second ledger
    level   of the intervals, 0.98: both ledgers' hold with 99 %, so both together with 98 % at least
    codes   the fingerprints of the code that was measured
    rows    part, name, place, over; before and after, times over the yardstick's; ratio, after / before, with its ends
            ratio_low and ratio_high, None where one was measured in fewer than 8 rounds; verdict: faster, slower, or
            unresolved, which differences below 2 % are, too
    only_a, only_b  keys that only one of them has
    Raises InputError where they are of different machines.
    """
    cpus = [str(ledger.provenance["machine"]["cpu"]) for ledger in (before, after)]
    prints = [ledger.provenance["machine_fingerprint"] for ledger in (before, after)]
    if prints[0] != prints[1]:
        named = " and ".join(cpus) if cpus[0] != cpus[1] else f"{cpus[0]}, of other cores, caches or vectors"
        fix = "compare ledgers of one machine: phongbench bench --out FILE makes one here"
        raise InputError(f"the ledgers are of different machines: {named}", second, fix)
    first, then = ({entry.key: entry for entry in ledger.entries} for ledger in (before, after))
    rows = [_row(entry, then[key]) for key, entry in first.items() if key in then]
    rows.sort(key=lambda row: (row["verdict"] == UNRESOLVED, -max(row["ratio"], 1 / row["ratio"])))
    return {
        "machine": cpus[0],
        "codes": [ledger.provenance["code"] for ledger in (before, after)],
        "level": LEVEL,
        "rows": rows,
        "only_a": [_key(entry) for key, entry in first.items() if key not in then],
        "only_b": [_key(entry) for key, entry in then.items() if key not in first],
    }


def _row(before: Entry, after: Entry) -> dict[str, Any]:
    return {**_key(before), **change(_interval(before), _interval(after))}


def _interval(entry: Entry) -> Interval:
    """The ratio with its interval; what was measured too few times can be anything."""
    return Interval(entry.ratio, entry.ratio_low or 0.0, entry.ratio_high or math.inf)


def _key(entry: Entry) -> Mapping[str, Any]:
    known = asdict(entry)
    return {name: known[name] for name in ("part", "name", "place", "over")}
