"""A formula as a function in GLSL, HLSL, WGSL or C."""
