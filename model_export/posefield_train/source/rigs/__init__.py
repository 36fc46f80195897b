"""Checks and normalization of skeletons: dummy roots, rest poses, stretching bones, facing."""
