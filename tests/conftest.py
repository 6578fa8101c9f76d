"""What holds for all tests: nothing of theirs depends on time or on other processes, and how they share the cores."""

import gc
import importlib
import os
import pickle
import tempfile
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Any

import pytest
from filelock import FileLock
from hypothesis import HealthCheck, settings

#: Folders whose tests share something dear, a warm application, a browser, a report: one process runs all of them.
WHOLE = ("tests/api", "tests/browser", "tests/reports")
#: The first folder compiles nearly every kernel, the second few and the third none of ours, so on an empty cache two
#: processes seldom compile the same; browsers ask a server that would compile what the first does. The last has many
#: short files, so that all processes end at the same time.
ORDER = ("tests/api", "tests/reports", "tests/phongbench/targets", "tests/house", "tests/browser", "tests/phongbench")
#: With more processes than this, all would wait for the one that runs tests/api.
MOST = 4

#: until all tests are collected: of what that makes nothing is garbage
gc.disable()

settings.register_profile(
    "any-machine",
    parent=settings.get_profile(settings.get_current_profile_name()),
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.load_profile("any-machine")


@pytest.fixture(scope="session", autouse=True)
def own_temporary_folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """A temporary folder of this process and its children, where the lock of timings lies: nobody else's is met.

    The path is short, for browsers make sockets in it.
    """
    tmp_path_factory.getbasetemp()  # stays where it always is
    with (
        tempfile.TemporaryDirectory(prefix="pb-", ignore_cleanup_errors=True) as folder,
        pytest.MonkeyPatch.context() as patch,
    ):
        patch.setenv("TMPDIR", folder)
        patch.setattr(tempfile, "tempdir", None)
        yield


@pytest.fixture(scope="session")
def common_folder(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder that all processes of this session of pytest share."""
    folder = tmp_path_factory.getbasetemp()
    return folder.parent if hasattr(request.config, "workerinput") else folder


@pytest.fixture(scope="session")
def once(common_folder: Path) -> Callable[[str, Callable[[], Any]], Any]:
    """Make something dear once for all processes, by (name, make): the first makes and pickles it, others load it."""

    def made(name: str, make: Callable[[], Any]) -> Any:
        file = common_folder / f"{name}.pickle"
        with FileLock(f"{file}.lock"):
            if not file.exists():
                file.write_bytes(pickle.dumps(make()))
            return pickle.loads(file.read_bytes())

    return made


@pytest.fixture(scope="session")
def only_figures() -> Callable[..., AbstractContextManager[None]]:
    """Reports that are built meanwhile have no figures but these, by default two: figures are most of their work.

    For tests that need a report, or look at the rest of its page.
    """

    @contextmanager
    def only(*names: str) -> Iterator[None]:
        drawing = importlib.import_module("phongbench_reports.drawing")
        chosen = tuple(entry for entry in drawing.FIGURES if entry.name in (names or ("front", "speed")))
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(drawing, "FIGURES", chosen)
            yield

    return only


def unit_of(nodeid: str) -> str:
    """What one process runs together: a file, or all of a folder in WHOLE."""
    file = nodeid.split("::", maxsplit=1)[0]
    return next((folder for folder in WHOLE if file.startswith(folder + "/")), file)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int:
    """One process more than cores, for some wait for browsers and servers, but not more than are useful.

    On one core none but pytest itself.
    """
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return min(cores + 1, MOST) if cores > 1 else 0


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Units in an order of ours."""
    from xdist.scheduler import LoadScopeScheduling

    class Units(LoadScopeScheduling):
        def _split_scope(self, nodeid: str) -> str:
            return unit_of(nodeid)

    config.option.loadscopereorder = False  # else the units with most tests come first, which are not the longest
    return Units(config, log)


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """With several processes, the folders in ORDER, then any other."""

    def place(item: pytest.Item) -> int:
        return next((n for n, folder in enumerate(ORDER) if item.nodeid.startswith(f"{folder}/")), len(ORDER))

    if hasattr(config, "workerinput"):
        items.sort(key=place)


def pytest_collection_finish() -> None:
    """Python need not look for garbage among thousands of tests and what they import, nor as often as it does."""
    gc.collect()
    gc.freeze()
    gc.enable()
    gc.set_threshold(10_000, *gc.get_threshold()[1:])
