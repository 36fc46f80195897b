"""Procedural families of other figures than people: a quadruped that walks, a hand that grips."""
