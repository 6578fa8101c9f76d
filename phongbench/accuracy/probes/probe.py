"""What a probe is given: the plan, the swept cells and their rows, and how to report progress and violations."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import pandas as pd

from phongbench.accuracy.sweep import Sweep
from phongbench.formulas.spec import Approximation
from phongbench.inputs.plan import Plan


@dataclass
class ProbeContext:
    """The study so far.

    sweep       the prepared sweep, with its plan, registry, cells and failures
    accuracy    rows of accuracy so far: the sweep's, then those of the probes before this one
    worst       rows of worst so far, likewise
    jobs        threads that compiled code may use
    advance     called with the share (of 1) of this probe that was done since the last call
    note        called with a sentence that the user should read
    detail      called with one that only those want to read who look into how numbers are got
    violations  sentences on results that contradict each other; any makes the run end with exit code 3
    facts       what the manifest says of a probe, by its name: plain data for JSON
    """

    sweep: Sweep
    accuracy: pd.DataFrame
    worst: pd.DataFrame
    jobs: int = 1
    advance: Callable[[float], None] = lambda share: None
    note: Callable[[str], None] = lambda text: None
    detail: Callable[[str], None] = lambda text: None
    violations: list[str] = field(default_factory=list)
    facts: dict[str, Any] = field(default_factory=dict)

    @property
    def plan(self) -> Plan:
        """The plan of the study."""
        return self.sweep.plan

    @property
    def registry(self) -> Mapping[str, Approximation]:
        """The approximations of the study, the user's own among them."""
        return self.sweep.registry
