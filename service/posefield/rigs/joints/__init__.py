"""Joints of files at rest, whose rest pose has rotations, as skeletons at rest without."""
