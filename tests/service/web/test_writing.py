"""Tests of batched clips and encodings: files equal to those of single ones."""

import asyncio
import gc
import weakref
from dataclasses import replace

import pytest
from msgspec import structs

from posefield.encode.character import CENTIMETRES, METRES
from posefield.encode.formats import CLIP_ENCODERS
from posefield.http import batching
from posefield.http.batching import ClipBatcher
from posefield.inference import session
from posefield.question.motion_question import ClipQuestion
from posefield.synthesis import clips, poses
from posefield.synthesis.synthesizer import Synthesizer

USDC = CLIP_ENCODERS["usdc"]


@pytest.fixture(scope="module")
def model(walk_path):
    return Synthesizer("walk", session.load(walk_path))


@pytest.fixture(scope="module")
def questions(model):
    controls = {c.name: c.default for c in model.session.card.controls}
    return [ClipQuestion(controls=controls | {"haste": 3.0 + 0.1 * number}) for number in range(40)]


@pytest.fixture(scope="module")
def answers(model, questions):
    return [clips.synthesize_clip(model, question) for question in questions]


@pytest.fixture
def calls():
    """An encoder that notes how many files each of its calls wrote, and those numbers."""
    made = []

    def write(answers, convention):
        made.append(len(answers))
        return USDC.write(answers, convention)

    return replace(USDC, write=write), made


def written(encoder, wanted):
    async def ask():
        desk = ClipBatcher()
        own = [(convention, replace(answer)) for convention, answer in wanted]
        held = [weakref.ref(answer) for _, answer in own]
        files = await asyncio.gather(*(desk.file(encoder, c, a) for c, a in own))
        del own
        await asyncio.sleep(0)
        gc.collect()
        # A thread lets its arguments go a moment after it has told its result.
        for _ in range(1000):
            if any(answer() for answer in held):
                await asyncio.sleep(0.01)
        # The desk holds no answer and no task any more.
        assert not any(answer() for answer in held)
        assert asyncio.all_tasks() == {asyncio.current_task()}
        return files

    return asyncio.run(ask())


def test_what_is_wanted_at_once_is_written_together(calls, answers):
    encoder, made = calls
    wanted = [*((METRES, answer) for answer in answers), (CENTIMETRES, answers[0])]
    files = written(encoder, wanted)
    # Conventions are not mixed.
    assert sorted(made) == [1, len(answers) - batching.MAX_CLIPS, batching.MAX_CLIPS]
    assert files == [USDC.encode(answer, convention) for convention, answer in wanted]


def test_a_fault_reaches_everybody_and_the_next_is_written(answers):
    def broken(asked, convention):
        raise RuntimeError("broken")

    async def ask():
        desk = ClipBatcher()
        wrong = replace(USDC, write=broken)
        asking = (desk.file(wrong, METRES, answer) for answer in answers[:3])
        faults = await asyncio.gather(*asking, return_exceptions=True)
        return faults, await desk.file(USDC, METRES, answers[0])

    faults, file = asyncio.run(ask())
    assert [str(fault) for fault in faults] == ["broken"] * 3
    assert file == USDC.encode(answers[0], METRES)


def made(model, asked, encoder=USDC, most=poses.MAX_POSES):
    async def ask():
        batcher = ClipBatcher()
        asking = (batcher.clip(model, each, most, encoder, METRES) for each in asked)
        return await asyncio.gather(*asking, return_exceptions=True)

    return asyncio.run(ask())


def test_clips_that_are_asked_for_at_once_are_made_together(calls, model, questions, answers):
    encoder, sizes = calls
    found = made(model, questions, encoder)
    assert sum(sizes) == len(questions) and max(sizes) == batching.MAX_CLIPS
    assert [content for _, content in found] == [USDC.encode(answer) for answer in answers]
    assert [answer.trust for answer, _ in found] == [answer.trust for answer in answers]


def test_a_clip_that_may_be_long_is_made_alone(calls, model, questions):
    encoder, sizes = calls
    long = structs.replace(questions[0], fps=990.0)
    (found,) = made(model, [long], encoder)
    assert len(found[0].clip) > batching.MAX_BATCHED_FRAMES
    assert found[1] == USDC.encode(clips.synthesize_clip(model, long))
    made(model, [*questions[:2], long, long], encoder)
    assert sorted(sizes) == [1, 1, 1, 2]
