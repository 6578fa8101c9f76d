"""The adapter that tests run on: Mesa's software one in CI, whatever there is elsewhere."""

import os

import pytest

from phongbench.targets.webgpu.session import Adapter, found


def adapter_here() -> Adapter:
    """The adapter; the test is skipped where there is none, but fails in CI."""
    one, lacking = found()
    if one is None and os.environ.get("CI"):
        pytest.fail(f"{lacking}; CI must have an adapter", pytrace=False)
    if one is None:
        pytest.skip(str(lacking))
    return one
