"""Comparison of filled templates with usd-core's files of the same content, byte for byte."""

import tracemalloc
from dataclasses import dataclass, replace

import numpy as np
import pytest
from counted import Counted
from pxr import Sdf, Vt

from posefield.encode.usd import crate_template, custom_data, layer_metadata, prim_specs
from posefield.encode.usd import layer_content as contents
from posefield.encode.usd.layer_content import LayerContent
from posefield.encode.usd.prim_specs import ValueTypes
from posefield.encode.usd.template_cache import TemplateCache

RATE, UNIT = 29.97, 0.01
MIX = 1.0 / 3.0


@dataclass(frozen=True)
class Plain:
    """Layers of a SkelAnimation that has an extent, and of facts."""

    numbers: tuple[float, ...] = (RATE, UNIT)
    values: tuple[np.ndarray, ...] = ()

    def head(self, content):
        made = Sdf.Layer.CreateAnonymous("moves.usda")
        layer_metadata.set_custom_data(made, custom_data.usd_dictionary(content.facts.join()))
        made.timeCodesPerSecond = RATE
        made.pseudoRoot.SetInfo("metersPerUnit", UNIT)
        return made

    def layer(self, content):
        made = self.head(content)
        prim = prim_specs.prim(made, "Anim", "SkelAnimation")
        prim_specs.varying_attribute(prim, "translations", ValueTypes.Float3Array)
        prim_specs.varying_attribute(prim, "rotations", ValueTypes.QuatfArray)
        extent = Vt.Vec3fArray.FromNumpy(content.values["extent"])
        prim_specs.varying_attribute(prim, "extent", ValueTypes.Float3Array, extent)
        prim_specs.set_time_samples(prim, content.samples)
        return made

    def __hash__(self):
        return hash(self.numbers)


def content(seed=0, frames=7, joints=5, **said):
    rng = np.random.default_rng(seed)
    sizes = {"translations": (frames, joints, 3), "rotations": (frames, joints, 4)}
    samples = {name: rng.standard_normal(size, np.float32) for name, size in sizes.items()}
    told = {"model": f"m@{seed}", "sigma": 0.5 * seed, "mix": MIX + seed, "warnings": ["a", "b"]}
    extent = rng.standard_normal((2, 3), np.float32)
    return LayerContent(samples, {"extent": extent}, custom_data.split_facts(told | said))


def changed(made, **samples):
    return replace(made, samples=made.samples | samples)


def template(author, made):
    return crate_template.template(author, made, contents.pattern(made, author.numbers))


def pattern(made):
    return contents.pattern(made, Plain().numbers)


@pytest.mark.parametrize("frames", [1, 2, 7, 40])
def test_a_template_writes_what_usd_writes(frames):
    made = template(Plain(), content(1, frames))
    for seed in range(2, 5):
        other = content(seed, frames)
        assert pattern(other) == pattern(content(1, frames))
        assert made.write(Plain(), other) == crate_template.ordinary(Plain(), other)
    # The real part at the wrong end would be seen.
    swapped = changed(other, rotations=np.roll(other.samples["rotations"], 1, axis=-1))
    assert made.write(Plain(), swapped) != crate_template.ordinary(Plain(), other)


def test_a_template_is_not_changed_by_what_it_writes():
    made = template(Plain(), content(1))
    first = made.write(Plain(), content(2))
    made.write(Plain(), content(3))
    assert made.write(Plain(), content(2)) == first


def looped(made):
    rows = {name: rows.copy() for name, rows in made.samples.items()}
    for each in rows.values():
        each[-1] = each[0]
    return changed(made, **rows)


def still(made):
    return changed(made, translations=made.samples["translations"] * 0 + 2)


def pausing(made):
    return changed(made, rotations=made.samples["rotations"][[0, 1, 1, 1, 4, 5, 0]])


def lifeless(made):
    return pausing(still(made))


REPEATS = [looped, still, pausing, lifeless]


@pytest.mark.parametrize("repeat", REPEATS)
def test_equal_samples_are_written_once_as_usd_does(repeat):
    made = template(Plain(), repeat(content(1)))
    for seed in range(2, 5):
        other = repeat(content(seed))
        assert made.write(Plain(), other) == crate_template.ordinary(Plain(), other)
    assert pattern(other) != pattern(content(1))
    assert len(made) < len(template(Plain(), content(1)))


@pytest.mark.parametrize("repeat", REPEATS)
def test_the_pattern_of_other_samples_would_not_do(repeat):
    made = template(Plain(), content(1))
    assert made.write(Plain(), repeat(content(2))) != crate_template.ordinary(
        Plain(), repeat(content(2))
    )


def test_samples_of_equal_sums_are_told_apart():
    rows = np.array([[1, 2, 3], [3, 2, 1], [2, 2, 2], [1, 2, 3]], np.float32)[:, None]
    made = changed(content(1, 4, 1), translations=rows)
    assert pattern(made).samples[0][2] == (0, 1, 2, 0)


NUMBERS = [
    {"mix": 0.25},
    {"mix": RATE},
    {"mix": UNIT},
    {"mix": 0.1, "sigma": 0.1},
    {"mix": 0.1, "sigma": 0.2},
    {"mix": 0.0, "sigma": -0.0},
    {"mix": 1e300, "sigma": -1e-300},
    {"mix": 3.4028235677973366e38, "sigma": 1e-45},
]


@pytest.mark.parametrize("said", NUMBERS)
def test_numbers_are_kept_as_usd_does(said):
    """USD keeps what float32 holds beside its type, and any other number once."""
    first, second = content(1, **said), content(2, **said)
    made = template(Plain(), first)
    assert made.write(Plain(), second) == crate_template.ordinary(Plain(), second)


def test_numbers_of_another_pattern_would_not_do():
    made, other = template(Plain(), content(1)), content(2, mix=0.25)
    assert made.write(Plain(), other) != crate_template.ordinary(Plain(), other)


@pytest.mark.parametrize("word", ["Anim", "posefield", "translations", "rotations", "token"])
def test_a_text_that_is_a_word_of_the_layer_is_left_to_usd(word):
    made = template(Plain(), content(1))
    assert made.write(Plain(), content(2, model="another")) is not None
    other = content(2, model=word)
    found = made.write(Plain(), other)
    assert found is None or found == crate_template.ordinary(Plain(), other)
    assert made.write(Plain(), content(2, model="Anim")) is None


def test_texts_that_occur_twice_have_a_pattern_of_their_own():
    twice = content(1, warnings=["a", "a"])
    assert pattern(twice) != pattern(content(1))
    assert pattern(content(1, warnings=["model", "b"])) != pattern(content(1))
    other = content(2, warnings=["c", "c"])
    assert template(Plain(), twice).write(Plain(), other) == crate_template.ordinary(Plain(), other)


@pytest.mark.parametrize("text", ["", "ünïcode 左腕", 'quo"ted\n', "x" * 5000])
def test_any_text_is_spelt_as_usd_does(text):
    made, other = template(Plain(), content(1)), content(2, model=text)
    found = made.write(Plain(), other)
    assert found is None or found == crate_template.ordinary(Plain(), other)
    assert (found is None) == (text == "")


def test_arrays_that_usd_would_merge_are_left_to_usd():
    first, other = content(1, joints=2), content(2, joints=2)
    made = template(Plain(), first)
    assert made.write(Plain(), other) == crate_template.ordinary(Plain(), other)
    moves = other.samples["translations"].copy()
    moves[3] = other.values["extent"]
    assert made.write(Plain(), changed(other, translations=moves)) is None
    known = replace(Plain(), values=(np.ones((2, 3), np.float32),))
    made = template(known, first)
    assert made.write(known, other) is not None
    moves[3] = 1
    assert made.write(known, changed(other, translations=moves)) is None


# Layers of which no template can be made: what they hold is no copy of what was given.
class Negated(Plain):
    def layer(self, content):
        return super().layer(changed(content, translations=-content.samples["translations"]))


class Derived(Plain):
    def layer(self, content):
        made = super().layer(content)
        spec = prim_specs.varying_attribute(
            made.GetPrimAtPath("/Anim"), "highest", ValueTypes.Double
        )
        spec.default = float(content.samples["translations"].max()) / 3
        return made


class Sorted(Plain):
    def layer(self, content):
        moves = np.sort(content.samples["translations"], axis=0)
        return super().layer(changed(content, translations=moves))


class Optional(Plain):
    def layer(self, content):
        made = super().layer(content)
        if content.values["extent"][0, 0] > 0.5:
            prim_specs.varying_attribute(
                made.GetPrimAtPath("/Anim"), "more", ValueTypes.Double, 1.0
            )
        return made


@pytest.mark.parametrize("author", [Negated(), Derived(), Sorted(), Optional()])
def test_what_cannot_be_trusted_is_written_the_ordinary_way(author):
    assert template(author, content(1)) is None
    press = TemplateCache(crate_template, limit=10**6)
    for seed in range(4):
        assert press.write(author, content(seed)) == crate_template.ordinary(author, content(seed))


def test_a_template_is_made_for_the_second_of_a_pattern():
    form = Counted()
    press = TemplateCache(form, limit=10**6)
    press.write(Plain(), content(1))
    assert form.calls == {"ordinary": 1}
    for _ in range(6):
        press.write(Plain(), content(2))
    assert form.calls == {"ordinary": 1, "template": 1}
    press.write(Plain(), content(3, frames=8))
    assert form.calls == {"ordinary": 2, "template": 1}


def test_templates_are_kept_within_a_limit():
    size = len(template(Plain(), content(1)))
    press = TemplateCache(crate_template, limit=3 * size)
    for frames in (7, 8, 9, 10, 7):
        for seed in range(3):
            other = content(seed, frames)
            assert press.write(Plain(), other) == crate_template.ordinary(Plain(), other)
        assert press.used_bytes <= press.limit
    assert press.used_bytes > size
    nothing = TemplateCache(crate_template, limit=0)
    assert nothing.write(Plain(), content(1)) == crate_template.ordinary(Plain(), content(1))
    assert nothing.used_bytes == 0


def test_patterns_are_kept_within_the_limit_too():
    """Those in which samples repeat are as large as some templates."""
    made = [looped(content(1, frames)) for frames in range(1000, 1006)]
    tracemalloc.start()
    first = pattern(made[0])
    taken, size = tracemalloc.get_traced_memory()[0], contents.pattern_size(first)
    tracemalloc.stop()
    assert taken / 1.5 < size < 1.5 * taken
    assert contents.pattern_size(pattern(content(1, 1000))) < size / 10
    press = TemplateCache(crate_template, limit=int(3.5 * size))
    for each in made:
        press.write(Plain(), each)
    # Three, as a fourth has no room.
    assert 2.5 * size < press.used_bytes <= 3.5 * size
