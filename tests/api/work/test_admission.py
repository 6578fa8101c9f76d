"""Who may use a core: cost decides, the rest is told when to come back, and who is gone frees what was his."""

import asyncio
import gc
import threading
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from phongbench.compiler.lowering import FLOAT32, FLOAT64
from phongbench.formulas.formula import Formula
from phongbench_api.http import media
from phongbench_api.http.problems import BusyError, Cancelled, TooLargeError
from phongbench_api.service import Service
from phongbench_api.settings import Settings
from phongbench_api.work import evaluation
from phongbench_api.work.admission import Admission
from phongbench_api.work.evaluation import Lobe

LYON = Lobe(Formula.parse("lyon:cross:8"), 10.0)


class Client:
    """A request whose client leaves when it is told to."""

    def __init__(self) -> None:
        self.left = asyncio.Event()

    async def receive(self) -> dict[str, str]:
        await self.left.wait()
        return {"type": "http.disconnect"}


def admission(**settings: Any) -> Admission:
    made = Admission(Settings(**{"cores": 2, "max_wait": 1.0} | settings))
    made.open = True
    return made


async def do(place: Admission, cost: float, work: Callable[..., Any], client: Client | None = None) -> Any:
    return await place.run(client or Client(), cost, work, lambda result, spans: result, media.Spans())  # type: ignore[arg-type]


def test_small_work_is_done_at_once_and_large_work_in_a_thread() -> None:
    async def run() -> None:
        place = admission()
        assert await do(place, place.settings.inline_cost, lambda gone: threading.get_ident()) == threading.get_ident()
        assert await do(place, 0.1, lambda gone: threading.get_ident()) != threading.get_ident()

    asyncio.run(run())


def test_work_that_would_take_too_long_is_refused_with_its_estimate() -> None:
    async def run() -> None:
        with pytest.raises(TooLargeError, match=r"12\.0 s"):
            await do(admission(max_cost=10.0), 12.0, lambda gone: pytest.fail("done all the same"))

    asyncio.run(run())


def test_two_hundred_slow_requests_use_the_cores_and_the_rest_come_back_later() -> None:
    async def run() -> None:
        place, most, running, lock, go = admission(), 0, 0, threading.Lock(), threading.Event()

        def slow(gone: Callable[[], bool]) -> str:
            nonlocal most, running
            with lock:
                running += 1
                most = max(most, running)
            go.wait(30)
            with lock:
                running -= 1
            return "done"

        asked = [asyncio.ensure_future(do(place, 0.5, slow)) for _ in range(200)]
        while running < 2 or not place.wait:
            await asyncio.sleep(0)
        assert await do(place, 0.0, lambda gone: "health") == "health"
        go.set()
        answers = await asyncio.gather(*asked, return_exceptions=True)
        refused = [answer for answer in answers if isinstance(answer, BusyError)]
        assert len(refused) + answers.count("done") == 200
        assert most == 2
        # two run, and work for one second of both cores may wait
        assert answers.count("done") == pytest.approx(2 + 4, abs=2)
        assert all(int(problem.headers["retry-after"]) >= 1 for problem in refused)
        assert (place.pending, place.wait) == (pytest.approx(0), 0)

    asyncio.run(run())


@pytest.mark.parametrize("queued", [False, True], ids=["running", "waiting"])
def test_a_client_that_is_gone_frees_its_core(queued: bool) -> None:
    async def run() -> None:
        place, client, other, begun, go = admission(cores=1), Client(), Client(), threading.Event(), threading.Event()

        def tiles(gone: Callable[[], bool]) -> None:
            begun.set()
            while not gone():
                go.wait(0.001)
            raise Cancelled

        first = asyncio.ensure_future(do(place, 0.1, tiles, client))
        while not begun.is_set():
            await asyncio.sleep(0)
        if queued:
            second = asyncio.ensure_future(do(place, 0.1, lambda gone: pytest.fail("nobody waits"), other))
            for _ in range(5):
                await asyncio.sleep(0)
            other.left.set()
            with pytest.raises(Cancelled):
                await second
        client.left.set()
        with pytest.raises(Cancelled):
            await first
        assert place.pending == pytest.approx(0)
        assert await do(place, 0.1, lambda gone: "next") == "next"

    asyncio.run(run())


def test_a_kernel_stops_between_tiles() -> None:
    asked: list[int] = []

    def gone() -> bool:
        asked.append(1)
        return len(asked) > 2

    pairs = np.zeros((10 * evaluation.TILE, 3), np.float32)
    with pytest.raises(Cancelled):
        evaluation.values(LYON, pairs, pairs, FLOAT32, gone)
    assert len(asked) == 3


def test_nothing_is_begun_before_the_kernels_are_warm_nor_while_going_down() -> None:
    async def run() -> None:
        place = admission()
        for open_, draining in ((False, False), (True, True)):
            place.open, place.draining = open_, draining
            with pytest.raises(BusyError) as problem:
                await do(place, 0.1, lambda gone: pytest.fail("begun"))
            assert problem.value.headers["retry-after"]

    asyncio.run(run())


def test_bodies_on_their_way_in_are_bounded() -> None:
    async def run() -> None:
        place = admission(max_reading=100)
        async with place.receiving(1000):  # one alone always may
            with pytest.raises(BusyError):
                async with place.receiving(1):
                    pass
        async with place.receiving(60), place.receiving(40):
            assert place.reading == 100
        assert place.reading == 0

    asyncio.run(run())


def test_the_cost_grows_with_the_work(client: Any) -> None:
    kernels = client.app.state.service.kernels
    costs = [kernels.pairs_cost(LYON, FLOAT32, n) for n in (0, 1000, 10**6)]
    assert costs == sorted(costs)
    assert kernels.pairs_cost(LYON, FLOAT32, 1000, compare=True) > costs[1]
    assert kernels.pairs_cost(LYON, FLOAT64, 10**6) > costs[2]
    assert costs[0] < Settings().inline_cost


def test_a_kernel_that_is_not_compiled_is_never_compiled_on_the_event_loop(client: Any) -> None:
    from phongbench_api.work.warm_kernels import COMPILE_SECONDS, Kernels

    fresh = Kernels()
    assert fresh.pairs_cost(LYON, FLOAT32, 1) > COMPILE_SECONDS > Settings().inline_cost
    fresh.compile_pairs(LYON, FLOAT32)
    assert fresh.pairs_cost(LYON, FLOAT32, 1) < Settings().inline_cost
    assert fresh.curve_cost(LYON, 2) > COMPILE_SECONDS


def test_warming_up_stops_when_told() -> None:
    from phongbench_api.work.warm_kernels import Kernels

    assert Kernels().warm(lambda: True) is False


def test_collections_of_garbage_pass_over_what_a_warm_server_holds(monkeypatch: pytest.MonkeyPatch) -> None:
    place = Service(Settings())
    place.cool_down()  # servers of other tests may be warm in this process
    monkeypatch.setattr(place.kernels, "warm", lambda stop: True)
    place.warm_up()
    assert gc.get_freeze_count() > 10_000
    place.cool_down()
    assert gc.get_freeze_count() == 0
