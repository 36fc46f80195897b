"""Procedural families of the tests: a walk, a face, a hand and a quadruped."""
