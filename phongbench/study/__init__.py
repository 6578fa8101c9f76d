"""Runs a plan into a stored run."""
