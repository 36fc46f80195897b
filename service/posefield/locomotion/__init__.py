"""Locomotion: characters that follow paths with a model of a travelling cycle."""
