"""A formula as a function in another language: GLSL, HLSL, WGSL, Metal, C, CUDA, NumPy."""
