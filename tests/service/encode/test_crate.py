"""Binary layers that templates wrote, as usd-core reads them, beside those that it builds."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from pxr import Sdf, Vt

from posefield.encode import crate_sections, crate_template, layers
from posefield.encode.crate_template import LayerContent
from posefield.encode.layers import ValueTypes

UNIT, MIX = 0.01, 1.0 / 3.0


@dataclass(frozen=True)
class Plain:
    """Layers of a SkelAnimation that has an extent, and of facts."""

    rate: float = 29.97

    def with_rate(self, rate):
        return replace(self, rate=rate)

    def head(self, content):
        made = Sdf.Layer.CreateAnonymous("moves.usda")
        layers.set_custom_data(made, content.facts)
        made.timeCodesPerSecond = self.rate
        made.startTimeCode, made.endTimeCode = 0.0, content.frames - 1.0
        made.pseudoRoot.SetInfo("metersPerUnit", UNIT)
        return made

    def layer(self, content):
        made = self.head(content)
        prim = layers.prim(made, "Anim", "SkelAnimation")
        layers.varying_attribute(prim, "translations", ValueTypes.Float3Array)
        layers.varying_attribute(prim, "rotations", ValueTypes.QuatfArray)
        extent = Vt.Vec3fArray.FromNumpy(content.values["extent"])
        layers.varying_attribute(prim, "extent", ValueTypes.Float3Array, extent)
        layers.set_time_samples(prim, content.samples)
        return made


def content(seed=0, frames=7, joints=5, **said):
    rng = np.random.default_rng(seed)
    sizes = {"translations": (frames, joints, 3), "rotations": (frames, joints, 4)}
    samples = {name: rng.standard_normal(size, np.float32) for name, size in sizes.items()}
    told = {"model": f"m@{seed}", "sigma": 0.5 * seed, "mix": MIX + seed, "warnings": ["a", "b"]}
    extent = rng.standard_normal((2, 3), np.float32)
    return LayerContent(samples, {"extent": extent}, told | said)


def changed(made, **samples):
    return made._replace(samples=made.samples | samples)


def template(author, made):
    pattern = made.pattern
    return crate_template.template(author.with_rate(crate_template.MARKED_RATE), pattern)


def written(author, made):
    """The layer by a template, which there is, as usd-core reads it."""
    assert template(author, made) is not None
    return layers.crate_text(crate_template.usdc(author, made))


def built(author, made):
    """The layer of usd-core."""
    return author.layer(made).ExportToString()


@pytest.mark.parametrize("frames", [1, 2, 7, 40, 1000])
@pytest.mark.parametrize("rate", [29.97, 30.0, 120.0])
def test_a_template_writes_what_usd_writes(frames, rate):
    author = Plain(rate)
    other = content(2, frames)
    found = written(author, other)
    assert found == built(author, other)
    # The real part at the wrong end would be seen.
    swapped = changed(other, rotations=np.roll(other.samples["rotations"], 1, axis=-1))
    assert written(author, swapped) != found


def test_layers_of_all_lengths_rates_and_facts_share_a_template():
    first = template(Plain(), content(1))
    assert template(Plain(24.0), content(2, frames=90, more=["x"])) is first
    assert template(Plain(), content(1, joints=6)) is not first
    assert template(Plain(), content(1)._replace(facts={})) is not first


def test_a_layer_has_the_same_bytes_whatever_was_written_before():
    first = crate_template.usdc(Plain(), content(2))
    crate_template.usdc(Plain(), content(3, frames=9))
    assert crate_template.usdc(Plain(), content(2)) == first
    crate_template.template.cache_clear()
    assert crate_template.usdc(Plain(), content(2)) == first
    assert crate_template.usdc(Plain(), content(3)) != first


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


@pytest.mark.parametrize("repeat", [looped, still, pausing, lifeless])
def test_equal_samples_are_written_once_as_usd_does(repeat):
    author, made = Plain(), repeat(content(2))
    assert written(author, made) == built(author, made)
    ours = [len(crate_template.usdc(author, each)) for each in (made, content(2))]
    theirs = [len(layers.crate_bytes(author.layer(each))) for each in (made, content(2))]
    # Not all of the padding before arrays is the same.
    assert abs((ours[1] - ours[0]) - (theirs[1] - theirs[0])) <= 16
    assert ours[0] < ours[1]


def test_samples_of_equal_sums_are_told_apart():
    rows = np.array([[1, 2, 3], [3, 2, 1], [2, 2, 2], [1, 2, 3]], np.float32)[:, None]
    assert crate_sections.repeated_rows(rows).tolist() == [0, 1, 2, 0]
    assert crate_sections.repeated_rows(rows[:3]) is None


def test_arrays_that_equal_others_are_read():
    other = content(2, joints=2)
    moves = other.samples["translations"].copy()
    moves[3] = other.values["extent"]
    made = changed(other, translations=moves)
    assert written(Plain(), made) == built(Plain(), made)


# Layers of which no template can be made: what they hold is no copy of what was given.
class Negated(Plain):
    def layer(self, content):
        return super().layer(changed(content, translations=-content.samples["translations"]))


class Rated(Plain):
    def head(self, content):
        made = super().head(content)
        made.framesPerSecond = 2.0 * self.rate
        return made


@pytest.mark.parametrize("author", [Negated(), Rated()])
def test_what_cannot_be_verified_is_written_by_usd(author):
    assert template(author, content(1)) is None
    for seed in range(4):
        made = content(seed)
        expected = layers.crate_bytes(author.layer(made))
        assert crate_template.usdc(author, made) == expected
