"""What a formula is, all that ship, exact Phong, error laws, evaluation, and code in other languages."""
