"""Normals and heights from shading: the reflection model asked backwards, with its ambiguities told.

Axes everywhere: x to the right, y up, z and heights towards the viewer, who is far away.
"""
