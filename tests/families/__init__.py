"""Procedural families of the tests: a walk, a face and a quadruped."""
