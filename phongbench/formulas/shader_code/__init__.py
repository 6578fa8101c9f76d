"""A formula as a function in another language: GLSL, HLSL, WGSL, C, CUDA."""
