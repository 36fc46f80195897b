"""A clip as NumPy's own archive: one array a name, and what is said of it as JSON texts."""

import numpy as np
import orjson

from service.encode import arrays, axes, keyframes
from service.encode.convention import Convention
from service.motion.answer import ClipAnswer


def npz(answer: ClipAnswer, convention: Convention) -> bytes:
    """Archive that numpy.load opens without pickle, of what `keyframes.json` holds."""
    clip = axes.moved(convention, answer.clip)
    return arrays.archive(
        {
            "times": keyframes.times(clip),
            **{name: own.astype(np.float32) for name, own in keyframes.tracks(clip).items()},
            "names": np.array(clip.skeleton.names),
            "parents": np.array(clip.skeleton.parents, dtype=np.int32),
            "rate": np.array(clip.rate),
            "units": np.array(orjson.dumps(keyframes.units(convention)).decode()),
            "trust": np.array(orjson.dumps(answer.trust.facts()).decode()),
        }
    )
