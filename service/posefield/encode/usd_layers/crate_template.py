"""Binary USD layers by templates: usd-core writes one layer of a kind, others are filled in.

usd-core takes a millisecond and more per layer, NumPy a tenth of that. Places of values are not
derived from the file format: a layer with marks, which usd-core wrote, is searched for them. Behind
its values come time samples and facts, of any number. A template is accepted only if usd-core reads
a filled layer as one that it would write itself; otherwise usd-core writes all layers of that kind.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from posefield.encode.usd_layers import crate_facts, crate_sections, layer_content, layer_metadata
from posefield.encode.usd_layers.crate_facts import FactPlace
from posefield.encode.usd_layers.crate_sections import DOUBLE, CrateParts, SamplesPlace
from posefield.encode.usd_layers.layer_content import LayerBuilder, LayerContent, LayerPattern

MARKED_RATE, MARKED_END = 1.2345678901234567e-301, 1.2345678901234567e-302
"""Rate and last time code of the layer with marks; float32 holds neither."""
MAX_TEMPLATES = 64
"""Number of templates in memory; most take less than 100 kB."""
TRIAL_RATE, TRIAL_FRAMES = 29.97, 3
TRIAL_FACTS = {"number": 0.1, "half": 0.5, "text": "ada", "list": [0.1, 0.2], "of": [{"at": "a"}]}
"""Frames a second, distinct frames and facts of the layers by which templates are verified."""


@dataclass(frozen=True)
class CrateTemplate:
    """A layer with marks, and the places of samples, values, facts and times.

    facts: None for layers without.
    """

    parts: CrateParts
    rate: int
    end: int
    samples: Mapping[str, SamplesPlace]
    values: Mapping[str, int]
    facts: FactPlace | None

    def write(self, rate: float, content: LayerContent) -> bytes:
        """Return the layer of a content, at so many frames a second."""
        made = bytearray(self.parts.values)
        DOUBLE.pack_into(made, self.rate, rate)
        DOUBLE.pack_into(made, self.end, content.frames - 1)
        for name, at in self.values.items():
            value = content.values[name].tobytes()
            made[at : at + len(value)] = value
        times = crate_sections.add_times(made, content.frames)
        for name, place in self.samples.items():
            place.add(made, times, content.samples[name])
        sections = self.parts.sections
        if self.facts is not None:
            tables = self.facts.add(made, content.facts)
            sections = (*tables, *sections[len(tables) :])
        return crate_sections.join_crate(made, sections)


def usdc(author: LayerBuilder, content: LayerContent) -> bytes:
    """Return a binary layer; equal authors and contents have equal bytes."""
    # Layers of all rates and lengths have one template.
    found = template(author.with_rate(MARKED_RATE), layer_content.first_frame(content).pattern)
    if found is None:
        return layer_metadata.crate_bytes(author.layer(content))
    return found.write(author.rate, content)


@lru_cache(maxsize=MAX_TEMPLATES)
def template(author: LayerBuilder, pattern: LayerPattern) -> CrateTemplate | None:
    """Return the template of an author's layers of one pattern; None if it cannot be verified.

    author: of the marked rate. pattern: of a single frame.
    """
    marks = layer_content.random_content(pattern, {}, seed=1)
    made = author.layer(marks)
    made.endTimeCode = MARKED_END
    if pattern.facts:
        made.customLayerData = {layer_metadata.FACTS: crate_facts.MARK}
    parts = crate_sections.split_crate(layer_metadata.crate_bytes(made))
    found = parts and _located(parts, marks, pattern.facts)
    return found if found and _is_verified(found, author.with_rate(TRIAL_RATE), pattern) else None


def _is_verified(found: CrateTemplate, author: LayerBuilder, pattern: LayerPattern) -> bool:
    """Return whether usd-core reads filled layers as those that it builds itself."""
    facts = TRIAL_FACTS if pattern.facts else {}
    one = layer_content.random_content(pattern, facts, seed=2)
    rows = [0, *range(TRIAL_FRAMES), 0]
    others = {
        name: np.random.default_rng(3).standard_normal((TRIAL_FRAMES, *shape[1:]), np.float32)[rows]
        for name, shape in pattern.samples
    }
    return all(
        layer_metadata.crate_text(found.write(author.rate, content))
        == author.layer(content).ExportToString()
        for content in (one, replace(one, samples=others))
    )


def _located(parts: CrateParts, marks: LayerContent, facts: bool) -> CrateTemplate | None:
    values = parts.values
    rate, end = (values.find(DOUBLE.pack(mark)) for mark in (MARKED_RATE, MARKED_END))
    places = {name: values.find(value.tobytes()) for name, value in marks.values.items()}
    samples = {n: crate_sections.find_place(values, row) for n, row in marks.samples.items()}
    place = crate_facts.find_place(parts) if facts else None
    if min(rate, end, *places.values()) < 0 or (facts and place is None):
        return None
    known = {name: each for name, each in samples.items() if each is not None}
    complete = len(known) == len(samples)
    return CrateTemplate(parts, rate, end, known, places, place) if complete else None
