"""The sweep on a cluster of Dask: what its workers do, and how a study hands out the work."""
