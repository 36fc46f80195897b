"""Test of entity tags: they depend on the machine's rounding."""

import numpy as np

from posefield.inference import level_selection, session
from posefield.synthesis.synthesizer import Synthesizer


def test_a_machine_that_rounds_otherwise_has_other_tags(model_path, monkeypatch):
    opened = session.load(model_path)
    here = Synthesizer("reaching", opened).fingerprint
    assert Synthesizer("reaching", opened).fingerprint == here
    solve = np.linalg.solve
    monkeypatch.setattr(np.linalg, "solve", lambda a, b: np.nextafter(solve(a, b), 2.0))
    level_selection.rounding_fingerprint.cache_clear()
    there = Synthesizer("reaching", opened).fingerprint
    level_selection.rounding_fingerprint.cache_clear()
    assert there != here
