"""Acts and holds of a performance: motions of models without cycle, and poses that are kept."""
