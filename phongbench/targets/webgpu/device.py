"""The adapter and its device: programs are made ready, run and clocked here. Only the worker's process imports this."""

import struct
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import wgpu
from numpy.typing import NDArray

from phongbench.targets.webgpu.clock import Passes
from phongbench.targets.webgpu.programs import GROUP, ROW, TEXELS

#: features that are used where there are any: clocks on the device, and numbers of 16 bits
TIMESTAMPS, HALF = "timestamp-query", "shader-f16"
_FEATURES = (TIMESTAMPS, HALF)
_USAGE = wgpu.BufferUsage
#: what moves vectors, whose components trade places and stay as they are, and what other work tends to 1/2 by
_FACTOR, _SUMMAND = (1.0, 1.0, 1.0, 0.5), (0.0, 0.0, 0.0, 0.25)
#: passes of a submission at most
_CLOCKED = 6


def adapter() -> Any:
    """The adapter that WebGPU prefers for heavy work, a GPU before a software one; None where there is none."""
    found = wgpu.gpu.enumerate_adapters_sync()
    return min(found, key=_rank) if found else None


def _rank(one: Any) -> tuple[bool, ...]:
    """A GPU of its own before one of the processor's, any before software, and what clocks before what does not."""
    kind = one.info["adapter_type"]
    graphics = one.info["backend_type"] == "OpenGL"
    return (kind == "CPU", kind != "DiscreteGPU", graphics, TIMESTAMPS not in one.features)


def facts(one: Any) -> dict[str, Any]:
    """What an adapter says of itself, as plain data for `adapters.Adapter`."""
    about = one.info
    return {
        "name": str(about["device"] or about["vendor"] or "unnamed"),
        "driver": str(about["description"]),
        "backend": str(about["backend_type"]),
        "software": about["adapter_type"] == "CPU",
        "features": sorted(set(_FEATURES) & set(one.features)),
        "version": wgpu.__version__,
    }


@dataclass(frozen=True)
class Program:
    """A compute shader made ready, with what it is bound to for each pass of a submission."""

    pipeline: Any
    bound: Sequence[Any]


@dataclass(frozen=True, slots=True)
class Pass:
    """A pass of a submission: a program on so many threads, which repeats its calls, and is itself dispatched again."""

    program: Program
    threads: int
    repeats: int = 1
    dispatches: int = 1


class Device:
    """An adapter's device, and the buffers that programs share.

    given  float32 (threads, 3, 4)  up to three vectors for each thread
    """

    def __init__(self, one: Any, given: NDArray[np.float32]) -> None:
        features = [feature for feature in _FEATURES if feature in one.features]
        self._device = one.request_device_sync(required_features=features)
        self.clocks, self.threads = TIMESTAMPS in features, len(given)
        self._settings = [self._buffer(48, _USAGE.UNIFORM) for _ in range(_CLOCKED)]
        self._given, self._results = self._buffer(given.nbytes), self._buffer(4 * self.threads)
        self._texels = self._buffer(4 * TEXELS)
        self.give(given)
        kinds = ("read-only-storage", "storage", "uniform", "read-only-storage")
        self._layout = self._device.create_bind_group_layout(
            entries=[
                {"binding": i, "visibility": wgpu.ShaderStage.COMPUTE, "buffer": {"type": kind}}
                for i, kind in enumerate(kinds)
            ]
        )
        self._bound = self._bind(self._given, self._results)
        if self.clocks:
            self._queries = self._device.create_query_set(type="timestamp", count=2 * _CLOCKED)
            usage = _USAGE.QUERY_RESOLVE | _USAGE.COPY_SRC
            self._stamps = self._device.create_buffer(size=16 * _CLOCKED, usage=usage)

    def _buffer(self, size: int, kind: int = _USAGE.STORAGE) -> Any:
        return self._device.create_buffer(size=max(size, 64), usage=kind | _USAGE.COPY_SRC | _USAGE.COPY_DST)

    def _bind(self, given: Any, results: Any) -> Sequence[Any]:
        """Bind groups, one for each pass of a submission, which have settings of their own."""
        groups = []
        for settings in self._settings:
            buffers = (given, results, settings, self._texels)
            entries = [{"binding": i, "resource": {"buffer": buffer}} for i, buffer in enumerate(buffers)]
            groups.append(self._device.create_bind_group(layout=self._layout, entries=entries))
        return groups

    def program(self, text: str, copied: int = 0) -> Program:
        """A program of WGSL; wgpu's GPUValidationError where it is refused.

        copied  bytes of buffers of its own, which it reads and writes instead of the shared ones
        """
        module = self._device.create_shader_module(code=text)
        layout = self._device.create_pipeline_layout(bind_group_layouts=[self._layout])
        compute = {"module": module, "entry_point": "main"}
        pipeline = self._device.create_compute_pipeline(layout=layout, compute=compute)
        bound = self._bind(self._buffer(copied), self._buffer(copied)) if copied else self._bound
        return Program(pipeline, bound)

    def run(self, passes: Sequence[Pass]) -> Passes:
        """Run up to _CLOCKED passes in a row and wait for them."""
        started = time.perf_counter_ns()
        encoder = self._device.create_command_encoder()
        for place, one in enumerate(passes):
            self._encode(encoder, place, one)
        if self.clocks:
            encoder.resolve_query_set(self._queries, 0, 2 * len(passes), self._stamps, 0)
        self._device.queue.submit([encoder.finish()])
        # reading waits for the work, on every backend
        read = self._stamps if self.clocks else self._results
        held = np.frombuffer(self._device.queue.read_buffer(read, 0, 16 * len(passes)), np.uint64)
        wall = time.perf_counter_ns() - started
        stamps = held.astype(np.int64).reshape(-1, 2).tolist() if self.clocks else []
        return Passes(tuple((begin, end) for begin, end in stamps), wall)

    def _encode(self, encoder: Any, place: int, one: Pass) -> None:
        settings = struct.pack("<4I8f", one.repeats, one.threads, TEXELS - 1, 0, *_FACTOR, *_SUMMAND)
        self._device.queue.write_buffer(self._settings[place], 0, settings)
        begin, end = (f"{word}_of_pass_write_index" for word in ("beginning", "end"))
        stamps = {"query_set": self._queries, begin: 2 * place, end: 2 * place + 1} if self.clocks else None
        work = encoder.begin_compute_pass(timestamp_writes=stamps)
        work.set_pipeline(one.program.pipeline)
        work.set_bind_group(0, one.program.bound[place])
        groups = -(-one.threads // GROUP)
        for _ in range(one.dispatches):
            work.dispatch_workgroups(min(groups, ROW), -(-groups // ROW))
        work.end()

    def give(self, given: NDArray[np.float32]) -> None:
        """Other vectors for the first threads."""
        self._device.queue.write_buffer(self._given, 0, np.ascontiguousarray(given))

    def results(self, count: int) -> NDArray[np.float32]:
        """What the last pass wrote, of its first threads."""
        return np.frombuffer(self._device.queue.read_buffer(self._results, 0, 4 * count), np.float32).copy()
