"""The one place that names numba's flags: its cache goes where it may, and changes with what is compiled."""

import os
import subprocess
import sys
import warnings

import filelock
import numba
import pytest
from numba.core import caching

from phongbench.compiler import jit


def test_the_users_cache_folder_is_left_alone():
    before = numba.config.CACHE_DIR
    assert jit.driver(lambda x: x)(1.0) == 1.0
    assert before == numba.config.CACHE_DIR


def test_threads_that_compile_at_once_all_use_our_folder(tmp_path):
    code = (
        "from concurrent.futures import ThreadPoolExecutor\n"
        "import numba\n"
        "from phongbench.compiler import jit; from phongbench.formulas import coordinate_kernels as kernels\n"
        "from phongbench.formulas.registry import REGISTRY\n"
        "from phongbench.compiler.lowering import FLOAT32, FLOAT64\n"
        "wanted = [(p, n) for p in (FLOAT32, FLOAT64) for n in range(4)]\n"
        "with ThreadPoolExecutor(6) as pool:\n"
        "    list(pool.map(lambda w: kernels.values_kernel(REGISTRY['lyon'], w[0], (('n', w[1]),)), wanted))\n"
        "assert not numba.config.CACHE_DIR\n"
        "print(len(list(jit.cache_folder().rglob('*.nbc'))))\n"
    )
    environment = os.environ | {"PHONGBENCH_CACHE": str(tmp_path / "cache")}
    found = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, env=environment, capture_output=True, check=True)
    assert int(found.stdout) == 8
    assert [p.name for p in tmp_path.iterdir()] == ["cache"]


def test_the_folders_name_changes_with_the_sources(tmp_path, monkeypatch):
    monkeypatch.setenv("PHONGBENCH_CACHE", str(tmp_path))
    jit.cache_folder.cache_clear()
    try:
        first = jit.cache_folder().name
        jit.cache_folder.cache_clear()
        monkeypatch.setattr(numba, "__version__", "0.0.0")
        assert jit.cache_folder().name != first
    finally:
        jit.cache_folder.cache_clear()


def test_folders_that_nobody_used_for_long_are_forgotten(tmp_path, monkeypatch):
    old, recent, other = tmp_path / "kernels-old", tmp_path / "kernels-recent", tmp_path / "notes"
    for folder in (old, recent, other):
        folder.mkdir()
    os.utime(old, (0, 0))
    os.utime(other, (0, 0))
    monkeypatch.setenv("PHONGBENCH_CACHE", str(tmp_path))
    jit.cache_folder.cache_clear()
    try:
        current = jit.cache_folder()
    finally:
        jit.cache_folder.cache_clear()
    assert sorted(tmp_path.iterdir()) == sorted([current, recent, other])


def test_a_home_that_cannot_be_written_falls_back_with_one_warning(tmp_path, monkeypatch):
    blocked = tmp_path / "file"
    blocked.write_text("")
    monkeypatch.setenv("PHONGBENCH_CACHE", str(blocked))
    monkeypatch.setattr(jit.tempfile, "gettempdir", lambda: str(tmp_path))
    jit.cache_folder.cache_clear()
    try:
        with pytest.warns(RuntimeWarning, match="cannot write the kernel cache"):
            folder = jit.cache_folder()
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            assert jit.cache_folder() == folder
        assert tmp_path in folder.parents
    finally:
        jit.cache_folder.cache_clear()


def test_compiled_kernels_are_found_again_by_the_next_process(tmp_path):
    """Closures over lowered bodies hit the cache across processes; without that every start would compile anew."""
    code = (
        "from phongbench.compiler import jit; from phongbench.formulas import coordinate_kernels as kernels\n"
        "from phongbench.formulas.registry import REGISTRY\n"
        "from phongbench.compiler.lowering import FLOAT32\n"
        "kernels.values_kernel(REGISTRY['lyon'], FLOAT32, (('n', 3),))\n"
        "print(sorted((p.name, p.stat().st_mtime_ns) for p in jit.cache_folder().rglob('*.nb[ci]')))\n"
    )
    environment = os.environ | {"PHONGBENCH_CACHE": str(tmp_path)}
    first, second = (
        subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, check=True).stdout
        for _ in range(2)
    )
    assert first == second
    assert b".nbc" in first


def test_with_the_compiler_off_loops_are_found_by_address():
    code = (
        "import numpy as np\n"
        "from phongbench.formulas import kernel\n"
        "from phongbench.formulas.registry import REGISTRY\n"
        "from phongbench.formulas.spec import Setting\n"
        "print(kernel.evaluate(REGISTRY['lyon'], Setting(64.0, 64, 'taylor'), np.array([0.25]))[0] == 0.75**64)\n"
    )
    environment = os.environ | {"NUMBA_DISABLE_JIT": "1"}
    assert (
        subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, check=True).stdout
        == b"True\n"
    )


def test_an_index_of_kernels_is_read_and_written_by_one_process_at_a_time(tmp_path):
    """Two that add a kernel at once would give both the same name, and read each other's code under their own."""
    file = jit._shared_file(caching.IndexDataCacheFile, str(tmp_path), "kernel", source_stamp=1)
    read, free = file._load_index, []

    def watched():
        try:
            with filelock.FileLock(tmp_path / "kernel.lock", timeout=0):
                free.append(True)
        except filelock.Timeout:
            free.append(False)
        return read()

    file._load_index = watched
    file.save("one", 1)
    file.save("two", 2)
    assert free == [False, False]
    assert (file.load("one"), file.load("two")) == (1, 2)
    assert free[2:] == [True, True], "readers need not wait: index and kernel are each put in place whole"


def test_every_kernel_is_added_to_the_cache_that_way(tmp_path):
    code = (
        "import numpy as np\n"
        "from phongbench.compiler import jit\n"
        "run = jit.driver(lambda x: x.sum())\n"
        "run(np.ones(2))\n"
        "jit.elementwise(jit.signature(jit.array_type(np.float32)), lambda x: None)\n"
        "print(*sorted(p.suffix for p in jit.cache_folder().rglob('*-*.*') if p.is_file()))\n"
    )
    (tmp_path / "here.py").write_text(code)
    environment = os.environ | {"PHONGBENCH_CACHE": str(tmp_path / "cache")}
    found = subprocess.run([sys.executable, "here.py"], cwd=tmp_path, env=environment, capture_output=True, check=True)
    assert found.stdout.split() == [b".lock"] * 2 + [b".nbc"] * 2 + [b".nbi"] * 2


def test_a_loop_compiled_for_another_one_is_kept_in_a_file_shared_once():
    """Shared twice, it would wait for the lock that it holds itself: a service never became ready on a cold cache."""
    inner = jit._cached(lambda: jit._cached(lambda: caching.IndexDataCacheFile))
    assert inner.func is jit._shared_file
    assert inner.args == (caching.IndexDataCacheFile,)
    assert not hasattr(caching.IndexDataCacheFile, "func")  # numba's own again
