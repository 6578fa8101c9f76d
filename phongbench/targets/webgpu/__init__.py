"""Measured on an adapter of this machine through WebGPU: a GPU's, or a software one's, which is told as such."""
