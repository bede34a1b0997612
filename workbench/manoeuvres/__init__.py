"""Manoeuvres that a rig can be recorded with, and their rehearsal on models of it."""
