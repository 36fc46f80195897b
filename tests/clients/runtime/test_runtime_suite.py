"""Tests of the run time in TypeScript against the service: all shipped models and levels."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from posefield.inference import session
from posefield.question.motion_question import PoseQuestion
from posefield.synthesis import poses
from posefield.synthesis.synthesizer import Synthesizer

pytestmark = pytest.mark.system

SHIPPED = Path(poses.__file__).parents[1] / "shipped"
SHARES = (0.0, 0.35, 1.0)


def questions(card, level):
    """Yield controls and a performer: the defaults, a corner, a named performer, and outside."""
    shares = ({}, 0.9, 0.2, 1.2) if level == 0 else (0.4,)
    for index, share in enumerate(shares):
        controls = {
            c.name: c.minimum + share * (c.maximum - c.minimum) if share else c.default
            for c in card.controls
        }
        yield controls, card.performers[1] if index % 2 else None


def pose_answer(model, controls, performer, level):
    """Return a question for poses and what the service answers."""
    ask = {"controls": controls, "performer": performer, "level": level, "extrapolate": "ok"}
    first = poses.synthesize_poses(model, PoseQuestion(times=[0.0], exact="none", **ask))
    times = [share * first.trust.duration for share in SHARES]
    answer = poses.synthesize_poses(model, PoseQuestion(times=times, exact="none", **ask))
    return {
        "controls": controls,
        "options": {"level": level} | ({"performer": performer} if performer else {}),
        "times": times,
        "duration": answer.trust.duration,
        "sigma": answer.trust.sigma,
        "rotations": np.ravel(answer.rotations).tolist(),
        "rootPosition": np.ravel(answer.root_position).tolist(),
        "boneOffsets": np.ravel(answer.bone_offsets).tolist(),
    }


@pytest.fixture(scope="module")
def answers(tmp_path_factory):
    """Return a file of questions and the service's answers for all shipped models and levels."""
    cases = []
    for path in sorted(SHIPPED.glob("*.onnx")):
        model = Synthesizer(path.stem, session.load(path))
        cards = [(model.session.card, level) for level in range(len(model.session.card.levels))]
        asked = [(level, *one) for card, level in cards for one in questions(card, level)]
        cases.append(
            {
                "file": str(path),
                "poses": [pose_answer(model, *one, level) for level, *one in asked],
            }
        )
    file = tmp_path_factory.mktemp("answers") / "answers.json"
    file.write_text(json.dumps(cases))
    return file


@pytest.fixture
def assert_runs(in_package):
    return in_package("runtime")


def test_poses_equal_those_of_the_service_in_node(answers, assert_runs):
    said = assert_runs("npm", "test", POSEFIELD_ANSWERS=str(answers))
    assert re.search(r"ℹ pass [1-9]", said) and "\nℹ fail 0\n" in said
    assert "\nℹ skipped 0\n" in said
