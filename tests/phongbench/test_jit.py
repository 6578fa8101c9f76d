"""The one place that knows numba: its operations mean the same compiled and plain, its cache goes where it may."""

import os
import subprocess
import sys
import warnings

import filelock
import numba
import numpy as np
import pytest

from phongbench import jit

HALVES = np.concatenate(
    [
        np.array([0.0, -0.0, 1.0, -2.5, 6e-8, -6e-8, 65504.0, np.inf, -np.inf, np.nan]),
        np.random.default_rng(1).normal(size=200),
    ]
).astype(np.float16)


@jit.driver
def apply_rounding(x, out):
    for i in range(len(x)):
        out[i] = jit.round_to_half(x[i])


@jit.driver
def apply_product(x, y, out):
    for i in range(len(x)):
        out[i] = jit.half_product(x[i], y[i])


@jit.driver
def apply_select(x, out):
    for i in range(len(x)):
        out[i] = jit.select(x[i] > 0.5, x[i], np.float32(7.0))


@jit.driver
def apply_entry(table, index, out):
    local = jit.on_stack(table)
    for i in range(len(index)):
        out[i] = jit.entry(local, index[i])


@jit.driver
def apply_bits(x, out):
    for i in range(len(x)):
        out[i] = jit.float32_from_bits(jit.float32_bits(x[i]))


def test_rounding_to_half_is_numpys():
    x = np.random.default_rng(0).normal(size=2000).astype(np.float32) * np.logspace(-9, 6, 2000, dtype=np.float32)
    out = np.empty_like(x)
    apply_rounding(x, out)
    with np.errstate(over="ignore"):
        assert np.array_equal(out, x.astype(np.float16).astype(np.float32))


def test_products_of_halves_are_numpys():
    x, y = (v.ravel() for v in np.meshgrid(HALVES, HALVES))
    out = np.empty(len(x), np.float32)
    apply_product(x.astype(np.float32), y.astype(np.float32), out)
    with np.errstate(all="ignore"):
        assert np.array_equal(out, (x * y).astype(np.float32), equal_nan=True)


def test_select_takes_one_of_two():
    x = np.array([0.0, 0.6, np.nan, 1.0], np.float32)
    out = np.empty_like(x)
    apply_select(x, out)
    assert out.tolist() == [7.0, np.float32(0.6), 7.0, 1.0]


def test_a_table_is_looked_up_from_its_copy():
    table = np.arange(65, dtype=np.float32) ** 2
    index, out = np.array([0, 64, 5], np.int32), np.empty(3, np.float32)
    apply_entry(table, index, out)
    assert out.tolist() == [0.0, 4096.0, 25.0]


def test_bits_survive_the_round_trip():
    x = np.array([0.0, -0.0, 1.5, np.inf, 1e-45], np.float32)
    out = np.empty_like(x)
    apply_bits(x, out)
    assert x.tobytes() == out.tobytes()


def test_operations_are_plain_functions_too():
    assert jit.round_to_half(np.float32(0.1)) == np.float32(np.float16(0.1))
    assert jit.round_to_half(3) == 3
    assert jit.select(True, 1, 2) == 1
    assert jit.float64_bits(1.0) == 0x3FF0000000000000


def test_the_users_cache_folder_is_left_alone():
    before = numba.config.CACHE_DIR
    jit.driver(lambda x: x)
    assert before == numba.config.CACHE_DIR


def test_threads_that_compile_at_once_all_use_our_folder(tmp_path):
    code = (
        "from concurrent.futures import ThreadPoolExecutor\n"
        "import numba\n"
        "from phongbench import jit, kernels\n"
        "from phongbench.approximations import REGISTRY\n"
        "from phongbench.lowering import PRECISIONS\n"
        "wanted = [(p, n) for p in PRECISIONS.values() for n in range(4)]\n"
        "with ThreadPoolExecutor(6) as pool:\n"
        "    list(pool.map(lambda w: kernels.values_kernel(REGISTRY['lyon'], w[0], (('n', w[1]),)), wanted))\n"
        "assert not numba.config.CACHE_DIR\n"
        "print(len(list(jit.cache_folder().rglob('*.nbc'))))\n"
    )
    environment = os.environ | {"PHONGBENCH_CACHE": str(tmp_path / "cache")}
    found = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, env=environment, capture_output=True, check=True)
    assert int(found.stdout) == 16
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
        "from phongbench import jit, kernels\n"
        "from phongbench.approximations import REGISTRY\n"
        "from phongbench.lowering import FLOAT32\n"
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
        "from phongbench import kernels\n"
        "from phongbench.approximations import REGISTRY\n"
        "from phongbench.spec import Setting\n"
        "print(kernels.evaluate(REGISTRY['lyon'], Setting(64.0, 64, 'taylor'), np.array([0.25]))[0] == 0.75**64)\n"
    )
    environment = os.environ | {"NUMBA_DISABLE_JIT": "1"}
    assert (
        subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, check=True).stdout
        == b"True\n"
    )


def test_an_index_of_kernels_is_read_and_written_by_one_process_at_a_time(tmp_path):
    """Two that add a kernel at once would give both the same name, and read each other's code under their own."""
    file = jit._shared_file(cache_path=str(tmp_path), filename_base="kernel", source_stamp=1)
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
        "from phongbench import jit\n"
        "run = jit.driver(lambda x: x.sum())\n"
        "run(np.ones(2))\n"
        "jit.elementwise(jit.signature(jit.array_type(np.float32)), lambda x: None)\n"
        "print(*sorted(p.suffix for p in jit.cache_folder().rglob('*-*.*') if p.is_file()))\n"
    )
    (tmp_path / "here.py").write_text(code)
    environment = os.environ | {"PHONGBENCH_CACHE": str(tmp_path / "cache")}
    found = subprocess.run([sys.executable, "here.py"], cwd=tmp_path, env=environment, capture_output=True, check=True)
    assert found.stdout.split() == [b".lock"] * 2 + [b".nbc"] * 2 + [b".nbi"] * 2
