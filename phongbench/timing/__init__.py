"""Run times that can be believed: interleaved rounds, intervals, interference."""
