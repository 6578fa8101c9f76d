"""Ray-traced pictures of scenes, and what of their work need not be done."""
