"""Comparison of clips encoded in batches with usd-core's layers."""

import math

import conftest
import numpy as np
import pytest
from msgspec import structs

from posefield.encode import crate_template, layers, usd_clip
from posefield.encode.character import CENTIMETRES, Convention
from posefield.encode.formats import CLIP_ENCODERS, METRES
from posefield.motion import clip as clips
from posefield.motion import quat
from posefield.motion.skeleton import Skeleton
from posefield.question.results import ClipAnswer, ConstraintResult, Trust

INCHES = Convention(0.0254, "z")
CONVENTIONS = [METRES, CENTIMETRES, Convention(1.0, "z"), INCHES]


def answers(count, frames=30, person=None, seed=0, **said):
    """Clips that differ in all that clips of one model can."""
    rng, person = np.random.default_rng(seed), person or conftest.person()
    return [_answer(rng, frames, person, said) for _ in range(count)]


def _answer(rng, frames, person, said):
    joints, t = len(person), np.arange(frames)[:, None, None] / 30
    turns = quat.exp(np.sin(t * rng.uniform(1, 3, (joints, 3)) + rng.uniform(0, 1, (joints, 3))))
    path = rng.standard_normal(3) + t[:, 0] * rng.standard_normal(3)
    offsets = person.offsets * rng.uniform(0.9, 1.1, (joints, 1))
    controls = {"speed": float(rng.uniform(0, 2)), "turn rate": float(rng.uniform(-1, 1))}
    sigma, duration = (float(np.float32(number)) for number in rng.uniform(0, 2, 2))
    trust = Trust("walk@0123abcd", controls, "ada", 0, duration, sigma, True, ())
    made = clips.assemble(person, turns, path, offsets, 30.0)
    return ClipAnswer(made, structs.replace(trust, **said))


def ordinary(given, convention=METRES):
    """Texts of the layers of usd-core."""
    return [
        author.layer(content).ExportToString()
        for one in given
        for author, content in usd_clip.builders_and_contents([one], convention)
    ]


def written(given, convention=METRES, write=usd_clip.usdc):
    """All of them twice: templates are made on the way."""
    first = write(given, convention)
    assert write(given, convention) == first
    return first


def both(given, convention=METRES):
    """Return whether both forms hold what usd-core's layers do, the binary one by a template."""
    author, content = next(usd_clip.builders_and_contents(given, convention))
    pattern = content.pattern
    assert crate_template.template(author.with_rate(crate_template.MARKED_RATE), pattern)
    texts = ordinary(given, convention)
    read = [layers.crate_text(each) for each in written(given, convention)]
    return (
        read == texts
        and [each.decode() for each in written(given, convention, usd_clip.usda)] == texts
    )


@pytest.mark.parametrize("convention", CONVENTIONS)
def test_a_batch_is_written_as_usd_writes_it(convention):
    assert both(answers(5), convention)


@pytest.mark.parametrize("extension", ["usda", "usdc", "usdz"])
def test_a_clip_is_the_same_alone_and_among_others(extension):
    given = [*answers(3, 20), *answers(2, 31, seed=1), *answers(1, 1, seed=2), *answers(2, 20)]
    write = CLIP_ENCODERS[extension].write
    alone = [write([one], METRES)[0] for one in given]
    assert write(given, METRES) == alone
    assert write(given[::-1], METRES) == alone[::-1]
    assert write([], METRES) == []


FACTS = [
    {"warnings": ("speed 3 is beyond 2",)},
    {"performer": 'quo"ted 左腕'},
    {"sigma": math.nan},
    {
        "targets": (
            ConstraintResult("LeftHand at end", 1e-9, "m", True),
            ConstraintResult("Body at 0.5 s", 0.3, "m", True),
        )
    },
]


@pytest.mark.parametrize("said", FACTS)
def test_any_facts_are_written_as_usd_does(said):
    given = [*answers(2), *answers(3, seed=4, **said)]
    assert both(given, INCHES)


def chain(joints):
    names = tuple(f"j{joint}" for joint in range(joints))
    offsets = np.random.default_rng(1).uniform(0.1, 0.5, (joints, 3))
    return Skeleton(names, tuple(range(-1, joints - 1)), offsets, (), np.empty((0, 3)))


@pytest.mark.parametrize("joints", [1, 3, 40])
def test_skeletons_whose_arrays_are_as_large_as_others_will_do(joints):
    given = answers(4, person=chain(joints))
    assert both(given)


def test_awkward_numbers_are_written_as_usd_does():
    given = answers(6)
    odd = np.array([1e-7, 3e-6, 1e-5, 1.0, 1e13, 1e16, 2.0**24, -0.0, 5e-324, 1e-40])
    for one, scale in zip(given, (1, 1, 1e-6, 1e-3, 1e12, 1e15), strict=True):
        one.clip.translations[:10, 0, 0] = odd
        one.clip.translations[:, 1:] *= scale
    assert both(given)
    assert both(given, INCHES)
