"""phongbench: which specular-highlight formula to ship, by measured error, run time and stability."""

__version__ = "0.1.0"
