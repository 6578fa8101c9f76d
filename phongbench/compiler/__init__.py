"""Scalar Python compiled for any precision; knows nothing of light."""
