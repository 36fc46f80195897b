"""Recordings for tests of discovery: a body whose feet and hands follow functions of time."""

import numpy as np

from posefield_train.discover.recordings import Recording

RATE = 60.0


def body(times, speed=0.0, swing=0.0, period=1.2, hands=None, heading=0.0):
    """A recording of a body that walks along a heading, rad to the left of +z, and moves its hands.

    swing: half of the distance between the feet at its largest, leg lengths. hands: (F, 3), added
    to the right hand.
    """
    ahead = np.array([np.sin(heading), 0.0, np.cos(heading)])
    left = np.array([np.cos(heading), 0.0, -np.sin(heading)])
    hips = np.outer(speed * times, ahead) + np.array([0.0, 1.0, 0.0])
    phase = np.cos(2.0 * np.pi * times / period)[:, None]
    places = {
        "hips": hips,
        "neck": hips + np.array([0.0, 0.5, 0.0]),
        "head": hips + np.array([0.0, 0.7, 0.0]),
    }
    for side, sign in (("left", 1.0), ("right", -1.0)):
        beside = hips + 0.1 * sign * left
        foot = beside - np.array([0.0, 0.95, 0.0]) + 0.5 * sign * swing * phase * ahead
        places[f"{side}UpperLeg"] = beside
        places[f"{side}LowerLeg"] = 0.5 * (beside + foot)
        places[f"{side}Foot"] = foot
        places[f"{side}Toes"] = foot + 0.1 * ahead
        shoulder = beside + np.array([0.0, 0.45, 0.0])
        hand = shoulder - [0.0, 0.5, 0.0]
        if side == "right" and hands is not None:
            hand = hand + hands[:, :1] * left + hands[:, 1:2] * [0.0, 1.0, 0.0]
            hand = hand + hands[:, 2:] * ahead
        places[f"{side}UpperArm"] = shoulder
        places[f"{side}LowerArm"] = 0.5 * (shoulder + hand)
        places[f"{side}Hand"] = hand
    return places


def recording(file, seconds, **kwargs):
    """A recording of a number of seconds."""
    times = np.arange(round(seconds * RATE) + 1) / RATE
    return Recording(file, RATE, body(times, **kwargs))
