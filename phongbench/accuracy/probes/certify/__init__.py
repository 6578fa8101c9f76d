"""Proven bounds on the model error by ball arithmetic."""
