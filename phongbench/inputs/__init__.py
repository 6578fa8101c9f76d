"""What is measured: plans, strata of pairs, meshes, materials."""
