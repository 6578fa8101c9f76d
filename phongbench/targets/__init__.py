"""What a formula costs where it ships: cycles and instructions, by the chips' own compilers."""
