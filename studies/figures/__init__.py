"""Figures of comparisons, diagnoses, modes and closed loops, all in one style."""
