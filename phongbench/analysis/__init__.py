"""What stored runs answer: the front, recommendations, claims, comparisons."""
