"""Reference motions of robots inside training loops: models evaluated by NumPy, torch and JAX."""
