"""Characters that walk their own ways through a model of a cycle that travels."""
