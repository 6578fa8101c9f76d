"""WGSL on a device that wgpu finds: naga checks the code, and a compute shader runs it, one pair or triple a thread."""

import os
from functools import cache
from typing import Any

import numpy as np
import pytest

#: what a module needs around the formula's own text: directions in, values out, both float32
_AROUND = """
@group(0) @binding(0) var<storage, read> given: array<f32>;
@group(0) @binding(1) var<storage, read_write> made: array<f32>;
@compute @workgroup_size(64) fn main(@builtin(global_invocation_id) thread: vec3u) {{
    let i = thread.x;
    if (i >= arrayLength(&made)) {{
        return;
    }}
    made[i] = f32(highlight({taken}));
}}
"""


def _without(what: str) -> Any:
    if os.environ.get("CI"):
        pytest.fail(f"{what}; CI must have one", pytrace=False)
    pytest.skip(what)


@cache
def device() -> Any:
    """A device with float16, by Vulkan: Mesa's software adapter where there is no other."""
    try:
        import wgpu
    except ImportError:
        _without("no wgpu here")
    for adapter in wgpu.gpu.enumerate_adapters_sync():
        if adapter.info["backend_type"] == "Vulkan" and "shader-f16" in adapter.features:
            return adapter.request_device_sync(required_features=["shader-f16"])
    return _without("no Vulkan adapter with shader-f16")


def rounds_to_nearest() -> bool:
    """True of Mesa's software device, which computes as processors do."""
    return "llvmpipe" in str(device().adapter.info["device"])


def refusal(text: str) -> str:
    """What naga says against a module; "" where it takes it."""
    import wgpu

    try:
        device().create_shader_module(code=text)
    except wgpu.GPUError as error:
        return str(error)
    return ""


def values(text: str, kind: str, *directions: Any) -> Any:
    """Highlights (n,) float32 of directions (n, 3), by the text of a formula that takes `kind`, vec3f or vec3h."""
    import wgpu

    here, count, width = device(), len(directions[0]), 3 * len(directions)
    taken = ", ".join(
        f"{kind}(vec3f({', '.join(f'given[{width}u * i + {3 * d + axis}u]' for axis in range(3))}))"
        for d in range(len(directions))
    )
    module = here.create_shader_module(code=text + _AROUND.format(taken=taken))
    pipeline = here.create_compute_pipeline(layout="auto", compute={"module": module, "entry_point": "main"})
    data = np.ascontiguousarray(np.concatenate(directions, axis=1), np.float32)
    given = here.create_buffer_with_data(data=data, usage=wgpu.BufferUsage.STORAGE)
    made = here.create_buffer(size=4 * count, usage=wgpu.BufferUsage.STORAGE | wgpu.BufferUsage.COPY_SRC)
    entries = [{"binding": i, "resource": {"buffer": buffer}} for i, buffer in enumerate((given, made))]
    encoder = here.create_command_encoder()
    run = encoder.begin_compute_pass()
    run.set_pipeline(pipeline)
    run.set_bind_group(0, here.create_bind_group(layout=pipeline.get_bind_group_layout(0), entries=entries))
    run.dispatch_workgroups(-(-count // 64))
    run.end()
    here.queue.submit([encoder.finish()])
    return np.frombuffer(here.queue.read_buffer(made), np.float32)
