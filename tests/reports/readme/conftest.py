"""The made-up run as one of this machine."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from phongbench.inputs.plan import preset
from phongbench.results import provenance


@pytest.fixture(scope="module")
def made(run: Any) -> Any:
    """The made-up run, of this machine and of a changed quick preset."""
    plan = replace(preset("quick"), alphas=(10.0, 20.0, 50.0, 128.0, 200.0), samples=131072).validated()
    manifest = {**run.manifest, "plan": plan.as_dict(), "provenance": provenance.collect(1, ()).as_dict()}
    found = replace(run, manifest=manifest)
    object.__setattr__(found, "plan", plan)
    return found
