"""Which physical effect is missing: where it acts, which one it is, and whether to believe it."""
