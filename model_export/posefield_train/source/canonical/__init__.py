"""Canonical clips: jumps, heading and origin removed, seams closed."""
