"""Passages: motions of segments on the floor, of any skeleton of one tree, with exact targets."""
