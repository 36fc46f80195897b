"""Tests of cancellation in all long computations: repeated checks, and an early end."""

import json
from contextvars import copy_context

import pytest

from posefield.batch.job import archive_members
from posefield.common import cancellation
from posefield.common.cancellation import Cancellation, Cancelled
from posefield.encode import crowd_writer
from posefield.encode.formats import CLIP_ENCODERS
from posefield.http import archive_operations, crowd_operations
from posefield.http.api.settings import Settings
from posefield.locomotion import gait, walking_crowd
from posefield.question import json_decoding as bodies
from posefield.question.model_question import SigmaQuestion, SuggestQuestion
from posefield.question.motion_question import ClipQuestion, FileQuestion
from posefield.question.walk_question import WalkQuestion
from posefield.registry import model_registry
from posefield.synthesis import clips, crowd_synthesis, walking_feet
from posefield.synthesis.trust import grid, suggest


class Counted(Cancellation):
    """Counts how often the work looks at it; cancelled from look number `last` on."""

    def __init__(self, last):
        super().__init__()
        self.looks, self.last = 0, last

    def check(self):
        self.looks += 1
        if self.looks >= self.last:
            self.cancel()
        super().check()


@pytest.fixture(scope="module")
def reaching(model_path):
    return model_registry.load([model_path]).models["reaching"]


@pytest.fixture(scope="module")
def walk(walk_path):
    return model_registry.load([walk_path]).models["stroll"]


def controls(model):
    return {control.name: control.default for control in model.session.card.controls}


def contradictory(count):
    return [
        {"joint": "RightHand", "time": 0.01 * i, "position": [(-1) ** i, 1.0, 1.0]}
        for i in range(count)
    ]


def solved(model, walk):
    """A clip with targets that contradict each other."""
    body = json.dumps({"controls": controls(model), "targets": contradictory(8)}).encode()
    return clips.synthesize_clip(model, bodies.decode_question(FileQuestion, body))


def mapped(model, walk):
    """A grid of sigma."""
    return grid(model, SigmaQuestion(across="turn", along="target_height", columns=128, rows=128))


def suggested(model, walk):
    """Suggestions."""
    return suggest(model, SuggestQuestion(count=20))


def archived(model, walk):
    """An archive of clips."""
    asked = {"format": "usdc", "clips": [{"controls": controls(model)}] * 20}
    found = archive_operations.clip_order(model, json.dumps(asked).encode(), Settings())
    return list(archive_members(found.files()))


def crowded(model, walk):
    """Poses of a crowd."""
    asked = {"controls": controls(model), "time": [0.1] * 20_000}
    return crowd_synthesis.synthesize_crowd(
        model, crowd_operations.of_body(json.dumps(asked).encode(), 1e6)
    )


def planned(model, walk):
    """The plan of a crowd that walks."""
    return walking_crowd.build_crowd(
        walk, gait.fit_gait(walk.session), WalkQuestion(count=300, seconds=10.0)
    )


def walked(model, walk):
    """A crowd that walks, as USD."""
    made = walking_crowd.build_crowd(
        walk, gait.fit_gait(walk.session), WalkQuestion(count=300, seconds=1.0)
    )
    return list(crowd_writer.stream(made, "usdc"))


def stood(model, walk):
    """Motions of a crowd whose feet stand."""
    asked = WalkQuestion(count=300, seconds=1.0, feet="stand")
    return list(walking_feet.build_crowd(walk, gait.fit_gait(walk.session), asked).batches)


def several(model, walk):
    """Several clips, written together."""
    answers = [clips.synthesize_clip(model, ClipQuestion(controls=controls(model)))] * 8
    return CLIP_ENCODERS["usda"].write(answers, CLIP_ENCODERS["usda"].default_convention)


WORK = [solved, mapped, suggested, archived, crowded, planned, walked, stood, several]


@pytest.mark.parametrize("work", WORK, ids=lambda work: work.__name__)
def test_work_stops_when_it_is_cancelled(work, reaching, walk):
    own, context = Counted(6), copy_context()
    context.run(cancellation.current.set, own)
    with pytest.raises(Cancelled):
        context.run(work, reaching, walk)
    # Several threads of one crowd may look before the first of them has ended.
    assert 6 <= own.looks <= 14
