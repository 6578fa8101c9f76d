"""What the soak of a cluster tells; tests/phongbench/study/test_cluster.py kills each kind once."""

from soaking.cluster_kills import Kills
from soaking.tables import of_kills


def test_the_table_counts_kills_and_ends() -> None:
    kills = Kills(sweeping=7, faults=["x"])
    kills.ends.update({"done": 2, "lost": 3, "killed": 4})
    *_, first, last = of_kills({"worker": Kills(), "client": kills}).splitlines()
    assert first == "| worker | 0 | 0 | 0 | 0 | 0 |"
    assert last == "| client | 9 | 7 | 2 | 7 | 1 |"
