"""USD layers of performances with an animation for each segment beside the whole one.

    /Character                SkelRoot, the default prim, as in a layer of the whole alone
      Anim                    SkelAnimation of all frames, the only one that is bound
    /Performance              Scope: report without segments, and contacts of the feet
      Segments
        s000                  SkelAnimation of a segment's frames: report of the segment

A segment has the time samples of the whole from the frame at or before its begin to the frame at or
after its end, so at each time of its own both have the same value. The binary form stores equal
samples once.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from pxr import Sdf, Vt

from posefield.common.units import Booleans
from posefield.encode import layers, usd_clip
from posefield.encode.character import Convention
from posefield.encode.crate_template import LayerContent
from posefield.encode.layers import ValueTypes
from posefield.encode.usd_clip import ClipLayerBuilder
from posefield.question.performance_report import PerformanceAnswer, PerformanceReport

PERFORMANCE = Sdf.Path("/Performance")
SEGMENTS = PERFORMANCE.AppendChild("Segments")
CONTACT, CONTACT_JOINTS = "posefield:contact", "posefield:contactJoints"
"""Attributes of the scope: whether each foot stands, with a time sample at each change, and the
names of the joints of the feet in the report."""
ROUNDING = 1e-6
"""Largest rounding of a time in the report, s."""


def usda(answer: PerformanceAnswer, convention: Convention) -> bytes:
    """Return the layer as text."""
    text: str = _layer(answer, convention).ExportToString()
    return text.encode()


def usdc(answer: PerformanceAnswer, convention: Convention) -> bytes:
    """Return the layer in binary form."""
    return layers.crate_bytes(_layer(answer, convention))


def usdz(answer: PerformanceAnswer, convention: Convention) -> bytes:
    """Return a USDZ file of the binary layer."""
    return usd_clip.usdz_package(usdc(answer, convention))


def segment_frames(begin: float, end: float, rate: float, frames: int) -> range:
    """Return the frames of a segment: from the one at or before its begin to the one at its end.

    begin, end: s. rate: frames a second. frames: of the performance; an end after the last one
    has none of its own.
    """
    slack = ROUNDING * rate
    first = min(math.floor(begin * rate + slack), frames - 1)
    last = min(math.ceil(end * rate - slack), frames - 1)
    return range(first, max(first, last) + 1)


def _layer(answer: PerformanceAnswer, convention: Convention) -> Any:
    """Return the layer; its prims are valid while the caller holds it."""
    ((builder, content),) = usd_clip.builders_and_contents([answer], convention)
    layer = builder.layer(content)
    with Sdf.ChangeBlock():
        scope = layers.prim(layer, PERFORMANCE.name, "Scope")
        facts = answer.trust.facts()
        segments = facts.pop("segments")
        scope.customData = {layers.FACTS: layers.usd_dictionary(facts)}
        group = layers.prim(scope, SEGMENTS.name, "Scope")
        for index, segment in enumerate(segments):
            _add_segment(group, index, segment, builder, content)
    _add_contacts(layer, answer.trust, builder.rate, content.frames)
    return layer


def _add_segment(
    group: Any,
    index: int,
    facts: dict[str, Any],
    builder: ClipLayerBuilder,
    content: LayerContent,
) -> None:
    name = f"s{index:03}"
    prim = layers.add_animation(group, name, builder.rig.paths, builder.curves)
    prim.customData = {layers.FACTS: layers.usd_dictionary(facts)}
    frames = segment_frames(facts["begins"], facts["ends"], builder.rate, content.frames)
    rows = slice(frames.start, frames.stop)
    samples = {name: array[rows] for name, array in content.samples.items()}
    layers.set_time_samples(prim, samples, frames.start)


def _add_contacts(layer: Any, report: PerformanceReport, rate: float, frames: int) -> None:
    """Add the contacts of the feet that were made to stand; nothing for feet as predicted."""
    stances = () if report.feet is None else report.feet.stances
    joints = list(dict.fromkeys(stance.joint for stance in stances))
    if not joints:
        return
    times = np.arange(frames) / rate
    standing = np.zeros((len(times), len(joints)), dtype=bool)
    for stance in stances:
        during = (times >= stance.begin - ROUNDING) & (times <= stance.end + ROUNDING)
        standing[:, joints.index(stance.joint)] |= during
    scope = layer.GetPrimAtPath(PERFORMANCE)
    names = Vt.TokenArray(joints)
    layers.uniform_attribute(scope, CONTACT_JOINTS, ValueTypes.TokenArray, names)
    attribute = layers.varying_attribute(scope, CONTACT, ValueTypes.BoolArray)
    scope.attributes[CONTACT_JOINTS].custom = attribute.custom = True
    for frame in _changes(standing):
        values = Vt.BoolArray([bool(value) for value in standing[frame]])
        layer.SetTimeSample(attribute.path, frame, values)


def _changes(rows: Booleans) -> Sequence[int]:
    """Return the first row (F, K), and each that differs from the one before it."""
    changed = np.any(rows[1:] != rows[:-1], axis=1)
    return [0, *(np.flatnonzero(changed) + 1).tolist()]
