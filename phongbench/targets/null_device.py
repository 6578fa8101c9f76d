"""RADV without a chip, in a process of its own: SPIR-V files in, what the driver says of their machine code out.

The environment chooses the chip, see `radv`. A list of files is read from stdin as JSON, a list of answers written to
stdout; without files the only answer names the driver.
"""

import json
import sys
from pathlib import Path
from typing import Any

import vulkan as vk

_EXTENSION = "VK_KHR_pipeline_executable_properties"
_CAPTURE = (
    vk.VK_PIPELINE_CREATE_CAPTURE_STATISTICS_BIT_KHR | vk.VK_PIPELINE_CREATE_CAPTURE_INTERNAL_REPRESENTATIONS_BIT_KHR
)


class NullDevice:
    """A device of the chip that the environment names, with the layout of a program: one buffer in, one out."""

    def __init__(self) -> None:
        application = vk.VkApplicationInfo(apiVersion=vk.VK_MAKE_VERSION(1, 2, 0))
        self.instance = vk.vkCreateInstance(vk.VkInstanceCreateInfo(pApplicationInfo=application), None)
        self.physical = vk.vkEnumeratePhysicalDevices(self.instance)[0]
        self.device = self._device()
        buffers = [
            vk.VkDescriptorSetLayoutBinding(
                binding=i,
                descriptorType=vk.VK_DESCRIPTOR_TYPE_STORAGE_BUFFER,
                descriptorCount=1,
                stageFlags=vk.VK_SHADER_STAGE_COMPUTE_BIT,
            )
            for i in range(2)
        ]
        sets = vk.vkCreateDescriptorSetLayout(self.device, vk.VkDescriptorSetLayoutCreateInfo(pBindings=buffers), None)
        self.layout = vk.vkCreatePipelineLayout(self.device, vk.VkPipelineLayoutCreateInfo(pSetLayouts=[sets]), None)

    def _device(self) -> Any:
        """With the extension that tells of machine code, and 16-bit arithmetic where the chip has it."""
        told = vk.VkPhysicalDevicePipelineExecutablePropertiesFeaturesKHR(pipelineExecutableInfo=True)
        queue = vk.VkDeviceQueueCreateInfo(queueFamilyIndex=0, pQueuePriorities=[1.0])
        for half in (True, False):
            more = vk.VkPhysicalDeviceShaderFloat16Int8Features(pNext=told, shaderFloat16=True) if half else told
            wanted = vk.VkDeviceCreateInfo(pNext=more, pQueueCreateInfos=[queue], ppEnabledExtensionNames=[_EXTENSION])
            try:
                return vk.vkCreateDevice(self.physical, wanted, None)
            except vk.VkErrorFeatureNotPresent:
                continue
        raise RuntimeError(f"the driver lacks {_EXTENSION}")

    @property
    def driver(self) -> str:
        """Mesa's release."""
        number = vk.vkGetPhysicalDeviceProperties(self.physical).driverVersion
        return f"{number >> 22}.{number >> 12 & 0x3FF}.{number & 0xFFF}"

    def answer(self, code: bytes) -> dict[str, Any]:
        """Statistics by name, and the assembly."""
        module = vk.vkCreateShaderModule(self.device, vk.VkShaderModuleCreateInfo(codeSize=len(code), pCode=code), None)
        stage = vk.VkPipelineShaderStageCreateInfo(stage=vk.VK_SHADER_STAGE_COMPUTE_BIT, module=module, pName="main")
        wanted = vk.VkComputePipelineCreateInfo(flags=_CAPTURE, stage=stage, layout=self.layout)
        pipeline = vk.vkCreateComputePipelines(self.device, None, 1, [wanted], None)[0]
        executable = vk.VkPipelineExecutableInfoKHR(pipeline=pipeline, executableIndex=0)
        result = {"statistics": self._statistics(executable), "assembly": self._assembly(executable)}
        vk.vkDestroyPipeline(self.device, pipeline, None)
        vk.vkDestroyShaderModule(self.device, module, None)
        return result

    def _statistics(self, executable: Any) -> dict[str, int]:
        read = vk.vkGetDeviceProcAddr(self.device, "vkGetPipelineExecutableStatisticsKHR")
        return {_text(s.name): int(s.value.u64) for s in read(self.device, executable)}

    def _assembly(self, executable: Any) -> str:
        """The last representation. The binding asks for sizes only, so texts are read by the driver's own function."""
        name = "vkGetPipelineExecutableInternalRepresentationsKHR"
        function = vk.lib.vkGetDeviceProcAddr(self.device, vk.ffi.new("char[]", name.encode()))
        read = vk.ffi.cast(f"PFN_{name}", function)
        given, count = vk.ffi.new("VkPipelineExecutableInfoKHR*", executable), vk.ffi.new("uint32_t*")
        read(self.device, given, count, vk.ffi.NULL)
        texts = vk.ffi.new("VkPipelineExecutableInternalRepresentationKHR[]", count[0])
        for text in texts:
            text.sType = vk.VK_STRUCTURE_TYPE_PIPELINE_EXECUTABLE_INTERNAL_REPRESENTATION_KHR
        read(self.device, given, count, texts)
        room = [vk.ffi.new("char[]", text.dataSize) for text in texts]
        for text, held in zip(texts, room, strict=True):
            text.pData = held
        read(self.device, given, count, texts)
        return next(_text(held) for text, held in zip(texts, room, strict=True) if _text(text.name) == "Assembly")


def _text(value: Any) -> str:
    return value if isinstance(value, str) else str(vk.ffi.string(value).decode())


if __name__ == "__main__":
    device = NullDevice()
    files = json.load(sys.stdin)
    answers = [device.answer(Path(file).read_bytes()) for file in files] or [{"driver": device.driver}]
    json.dump(answers, sys.stdout)
