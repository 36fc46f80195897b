"""Tests of archives of many clips: generation in batches, and the manifest."""

import dataclasses

import pytest

from posefield.batch.clip_files import SENT_CLIPS, SENT_POSES, ArchiveOrder, ClipFormat
from posefield.batch.job import archive_members
from posefield.batch.rows import Row
from posefield.encode.conventions import METRES
from posefield.encode.formats import CLIP_ENCODERS
from posefield.inference import session
from posefield.question.motion_question import ClipQuestion
from posefield.synthesis import clips
from posefield.synthesis.synthesizer import Synthesizer


@pytest.fixture(scope="module")
def model(model_path):
    return Synthesizer("reaching", session.load(model_path))


@pytest.fixture
def order(model):
    """An order of clips at some rates, and the frames of each batch that was made."""
    made = []

    def write(answers, convention):
        made.append([len(answer.clip) for answer in answers])
        return [b"%d" % sum(made[-1])] * len(answers)

    def ordered(rates):
        middle = {control.name: control.default for control in model.session.card.controls}
        questions = [ClipQuestion(controls=middle, fps=rate) for rate in rates]
        queries = [Row(f"c{i}", "json", q, f"/clips/{i}") for i, q in enumerate(questions)]
        encoder = dataclasses.replace(CLIP_ENCODERS["json"], write=write)
        prospects = [clips.preview_clip(model, question) for question in questions]
        return ArchiveOrder(model, ClipFormat(encoder, METRES), queries, prospects)

    return ordered, made


def test_batches_are_bounded_in_clips_and_in_poses(order):
    ordered, made = order
    rates = [10] * 40 + [1000] * 5 + [10] * 3
    asked = ordered(rates)
    members = archive_members(asked.files())
    next(members)
    # A batch is made when its first file is taken.
    assert len(made) == 1
    assert len(list(members)) == len(rates)
    assert [frames for batch in made for frames in batch] == [p.frames for p in asked.previews]
    assert all(len(batch) <= SENT_CLIPS for batch in made)
    assert all(sum(batch) <= SENT_POSES for batch in made)
    assert [len(batch) for batch in made[:2]] == [SENT_CLIPS, SENT_CLIPS]
    assert max(map(sum, made)) > SENT_POSES / 2
