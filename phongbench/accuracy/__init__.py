"""How wrong each formula is: the sweep over sampled pairs, and probes beyond it."""
