"""Models whose cards have the limits of the knees and elbows of their predictions."""

from dataclasses import replace

import numpy as np

from posefield.motion import hinges, skeleton
from posefield.question.motion_question import ClipQuestion
from posefield.synthesis import clips
from posefield.synthesis.synthesizer import Synthesizer

ENDS = {"LowerLeg": "Foot", "LowerArm": "Hand"}


def questions(card, count=8, **fields):
    """Return questions at captured clips; a callable field is called with the number."""
    names = [control.name for control in card.controls]
    return [
        ClipQuestion(
            controls=dict(zip(names, card.examples[7 * row], strict=True)),
            extrapolate="ok",
            **{key: value(row) if callable(value) else value for key, value in fields.items()},
        )
        for row in range(count)
    ]


def known_limits(model, scale=1.0):
    """Return the model with the hinges of its predictions, whose ranges are scaled."""
    card, found = model.session.card, []
    motions = clips.synthesize_clips(model, questions(card, feet="predicted"))
    for side in ("left", "right"):
        for hinge, end in ENDS.items():
            joint, tip = (card.skeleton.names.index(card.roles[side + r]) for r in (hinge, end))
            chain = skeleton.joint_chain(card.skeleton.parents, tip)
            child = chain[chain.index(joint) + 1]
            turns = np.concatenate([motion.clip.rotations[:, joint] for motion in motions])
            bones = (np.tile(card.skeleton.offsets[j], (len(turns), 1)) for j in (joint, child))
            limits = hinges.measure(joint, turns, *bones)
            found.append(replace(limits, high=(scale * limits.high[0], *limits.high[1:])))
    card = replace(card, hinges=tuple(sorted(found, key=lambda hinge: hinge.joint)))
    return Synthesizer(model.name, replace(model.session, card=card))


def excess(limits, answers):
    """Return the largest angles (3,) of hinges beyond their range, rad."""
    angles = [limits.angles(answer.clip.rotations) for answer in answers]
    beyond = [np.maximum(limits.low - a, a - limits.high).max(axis=(0, 1)) for a in angles]
    return np.max(beyond, axis=0)
