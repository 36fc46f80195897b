"""Stages of USD: their skeletons and the joints at rest."""
