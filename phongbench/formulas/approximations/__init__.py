"""One file a formula (or a family of them): the scalar kernel with its contract, and SPEC."""
