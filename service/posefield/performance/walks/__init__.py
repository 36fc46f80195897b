"""Walks of a performance: paths, speeds, plans and poses of a cyclic model."""
