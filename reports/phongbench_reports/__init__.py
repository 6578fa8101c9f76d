"""Draws a finished run: a folder (or a single file) that answers "which highlight formula at my exponents?"."""

from phongbench_reports.build import build

__all__ = ["build"]
