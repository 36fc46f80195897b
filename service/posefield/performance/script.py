"""Scripts whose models, numbers and character are checked before any motion is made."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace

import msgspec
import numpy as np

from posefield.common.errors import InvalidField, QueryError
from posefield.common.units import Bones
from posefield.common.value_cache import ValueCache
from posefield.feet import footsteps
from posefield.feet.footsteps import Character
from posefield.locomotion import stride
from posefield.locomotion.gait import Gait
from posefield.model_file.model_card import ModelCard
from posefield.motion import hinges, joint_roles, quat
from posefield.motion.contact_detection import FootContact
from posefield.motion.hinges import Hinge
from posefield.motion.skeleton import Skeleton
from posefield.performance import join_quality
from posefield.performance.passage import (
    Passage,
    SkeletonMatch,
    SkeletonsDiffer,
    leg_share,
    match_skeletons,
    scale_heights,
)
from posefield.question.motion_question import MotionQuestion, check_number, check_range, check_take
from posefield.question.performance_question import (
    Act,
    Curve,
    Hold,
    PerformanceQuestion,
    Segment,
    Walk,
)
from posefield.synthesis import walking_feet
from posefield.synthesis.synthesizer import Synthesizer

MOST_PLACE, MOST_ANGLE, MOST_RADIUS, MOST_RATE = 1e4, 1e3, 1e3, 1e3
"""Largest coordinates, m, angles, rad, radii, m, and speeds, m/s or rad/s."""
MIN_SECONDS, MAX_SECONDS = 0.1, 600.0
"""Shortest segment with a duration of its own, and longest performance, s."""
MIN_FPS, MAX_FPS = 1.0, 240.0
MAX_BLEND = 5.0
"""Longest time of a blend, s."""

Bounded = tuple[str, float, float, float, str]
"""Field, value, least, most and unit."""


def check_bounds(question: PerformanceQuestion) -> None:
    """Raise InvalidField for a number out of bounds, with a pointer into the script."""
    for field, value, low, high, unit in _numbers(question):
        check_range(field, check_number(field, value), low, high, unit)
    for field, value, unit in _positive(question):
        if not value > 0.0:
            raise InvalidField(field, f"{value:.9g} {unit}, expected more than 0 {unit}")
    check_take(question.take, question.variety)
    if isinstance(question.segments[0], Hold) and not question.start.poses:
        raise InvalidField("segments/0", "a hold, expected a walk or an act before it")


def _numbers(question: PerformanceQuestion) -> Iterator[Bounded]:
    yield "fps", question.fps, MIN_FPS, MAX_FPS, "frames/s"
    yield from _places("start/position", question.start.position)
    yield "start/heading", question.start.heading, -MOST_ANGLE, MOST_ANGLE, "rad"
    for index, disc in enumerate(question.obstacles):
        yield from _places(f"obstacles/{index}/position", disc.position)
        yield f"obstacles/{index}/radius", disc.radius, -MOST_RADIUS, MOST_RADIUS, "m"
    for index, segment in enumerate(question.segments):
        yield from _of_segment(f"segments/{index}", segment)


def _positive(question: PerformanceQuestion) -> Iterator[tuple[str, float, str]]:
    """Yield field, value and unit of what is more than 0."""
    for index, disc in enumerate(question.obstacles):
        yield f"obstacles/{index}/radius", disc.radius, "m"
    for index, segment in enumerate(question.segments):
        if not isinstance(segment, Hold):
            field, join = f"segments/{index}/join", segment.join
            yield f"{field}/seconds", math.inf if join.seconds is None else join.seconds, "s"
            yield f"{field}/most", math.inf if join.most is None else join.most, "m"


def _of_segment(field: str, segment: Segment) -> Iterator[Bounded]:
    if not isinstance(segment, Act) and segment.seconds is not None:
        yield f"{field}/seconds", segment.seconds, MIN_SECONDS, MAX_SECONDS, "s"
    if not isinstance(segment, Hold) and segment.join.seconds is not None:
        yield f"{field}/join/seconds", segment.join.seconds, -MAX_BLEND, MAX_BLEND, "s"
    if not isinstance(segment, Hold) and segment.join.most is not None:
        yield f"{field}/join/most", segment.join.most, -MOST_PLACE, MOST_PLACE, "m"
    if isinstance(segment, Walk):
        yield from _curve(f"{field}/turn", segment.turn, "rad/s")
        yield from _curve(f"{field}/speed", segment.speed, "m/s")
        for index, point in enumerate(segment.along or ()):
            yield from _places(f"{field}/along/{index}", point)
        yield from _places(f"{field}/to", segment.to or ())
    if isinstance(segment, Act):
        yield from _places(f"{field}/at", segment.at or ())
    if isinstance(segment, Hold):
        yield from _places(f"{field}/look_at", segment.look_at or ())
    elif segment.facing is not None:
        yield f"{field}/facing", segment.facing, -MOST_ANGLE, MOST_ANGLE, "rad"


def _curve(field: str, curve: float | Curve | None, unit: str) -> Iterator[Bounded]:
    if isinstance(curve, int | float):
        yield field, curve, -MOST_RATE, MOST_RATE, unit
        return
    for index, (knot, value) in enumerate(curve or ()):
        yield f"{field}/{index}/0", knot, -MOST_PLACE, MOST_PLACE, ""
        yield f"{field}/{index}/1", value, -MOST_RATE, MOST_RATE, unit


def _places(field: str, values: Sequence[float]) -> Iterator[Bounded]:
    for axis, value in enumerate(values):
        yield f"{field}/{axis}", value, -MOST_PLACE, MOST_PLACE, "m"


# Characters whose bones are kept, by model, controls and labels; 1 kB each.
KEPT_BONES = 256
HIGHEST_LIFT = 1.5
"""Largest lift of a character's feet over that of the captured walks of a script."""


@dataclass(frozen=True)
class Source:
    """Model of a segment, and what turns its poses into poses of the character.

    share: leg length of the character over that of the model's own bones at its typical controls.
    feet: for each leg of the character, the column of its foot in the contacts of passages.
    own_gait: of a cyclic model.
    """

    model: Synthesizer
    match: SkeletonMatch
    share: float
    feet: tuple[int, ...]
    own_gait: Gait | None = None

    @property
    def gait(self) -> Gait:
        """Return the gait of a cyclic model; TypeError for another one."""
        if self.own_gait is None:
            raise TypeError(f"{self.model.name}, expected a model of a gait")
        return self.own_gait

    @property
    def contacts(self) -> tuple[FootContact | None, ...]:
        """Contacts of the character's feet in captured clips of the model; None for unknown."""
        card = self.model.session.card
        contacts = {contact.joint: contact for contact in walking_feet.foot_contacts(card)}
        joints = list(contacts) if card.cyclic else list(card.feet)
        return tuple(contacts.get(joints[column]) for column in self.feet)

    def adapted(self, passage: Passage) -> Passage:
        """Return a passage of the model as one of the character."""
        roots = scale_heights(passage.roots, self.share)
        return Passage(
            self.match.rotations(passage.rotations),
            roots,
            passage.contacts[:, list(self.feet)],
            passage.sigmas,
            passage.phases,
        )


@dataclass(frozen=True)
class ScriptCharacter:
    """Character of a performance.

    identity: of the model whose bones it has. roles: of the joints. facing: of the rest pose, rad,
    from +Z to the left. feet: joints that stand.
    contacts: of these feet, as captured.
    """

    identity: str
    skeleton: Skeleton
    roles: Mapping[str, str]
    facing: float
    bones: Bones
    body: Character
    feet: tuple[int, ...]
    contacts: tuple[FootContact, ...]


@dataclass(frozen=True)
class Script:
    """A script whose models are known. sources: of the segments; None for holds."""

    question: PerformanceQuestion
    sources: tuple[Source | None, ...]
    character: ScriptCharacter

    @property
    def segments(self) -> tuple[Segment, ...]:
        """Segments in order."""
        return self.question.segments

    def adapted(self, segment: int, passage: Passage) -> Passage:
        """Return the motion of a segment's model as one of the character, on the floor."""
        source, character = self.sources[segment], self.character
        if source is None:
            return passage
        return join_quality.on_floor(character.body, source.adapted(passage), character.contacts)[0]

    @property
    def contacts(self) -> tuple[FootContact, ...]:
        """Contacts of the character's feet, whose swings are those of all models of the script.

        They are as long as in the model with the longest, and lifted by no more than 1.5 times as
        much as in the walks: a character that hops does not walk as it hops.
        """
        return tuple(
            self._contact(foot, contact) for foot, contact in enumerate(self.character.contacts)
        )

    def _contact(self, foot: int, captured: FootContact) -> FootContact:
        pairs = [(source.contacts[foot], source.own_gait) for source in self.sources if source]
        contacts = [contact for contact, _ in pairs if contact is not None] or [captured]
        walks = [contact.clearance for contact, gait in pairs if contact is not None and gait]
        return replace(
            captured,
            swing=max(contact.swing for contact in contacts),
            longest_swing=max(contact.longest_swing for contact in contacts),
            clearance=min(captured.clearance, HIGHEST_LIFT * max(walks, default=np.inf)),
        )

    @property
    def identities(self) -> tuple[str, ...]:
        """Identities of the models, each once, in the order of the script."""
        return tuple(dict.fromkeys(source.model.identity for source in self.sources if source))


@contextmanager
def errors_under(*path: str | int) -> Iterator[None]:
    """Raise QueryErrors of the block with the path of a part of the script before their field."""
    try:
        yield
    except QueryError as fault:
        inner = fault.field if fault.index is None else f"{fault.field}/{fault.index}"
        # The end of a walk to an act is no field of the script.
        inner = "" if inner == "end" else inner
        # Obstacles are those of the whole script.
        outer = () if inner.startswith("obstacles") else path
        field = "/".join(str(name) for name in (*outer, inner) if name != "")
        raise type(fault)(field, fault.message) from fault


def resolve_script(question: PerformanceQuestion, find: Callable[[str], Synthesizer]) -> Script:
    """Return a script with its models and its character.

    find: returns the model of a name; raises UnknownModel. Raises QueryError, whose field is a
    pointer into the script, for a model that cannot play its part, for skeletons that differ, and
    for numbers out of range.
    """
    check_bounds(question)
    models = [_model(index, model, find) for index, model in enumerate(question.segments)]
    for card in (model.session.card for model in models if model is not None):
        if not 0 <= question.level < len(card.levels):
            coarsest = len(card.levels) - 1
            raise InvalidField(
                "level", f"{question.level}, expected 0 to {coarsest}, as {card.name} has"
            )
    character = _character(question, models, find)
    # Refused here, as a plan refuses what its performance would.
    joint_roles.rename_joints(character.skeleton, character.roles, question.names)
    return Script(question, tuple(_sources(question, models, character)), character)


def _model(index: int, segment: Segment, find: Callable[[str], Synthesizer]) -> Synthesizer | None:
    if isinstance(segment, Hold):
        return None
    with errors_under("segments", index):
        model = find(segment.model)
        card = model.session.card
        if isinstance(segment, Act) and card.cyclic:
            raise InvalidField(
                "model", f"{card.name} is a cycle, expected an act of another motion"
            )
        if isinstance(segment, Walk) and not (card.cyclic and card.root == "travelling"):
            raise InvalidField("model", f"{card.name} does not walk, expected a cycle that travels")
        return model


def _character(
    question: PerformanceQuestion,
    models: Sequence[Synthesizer | None],
    find: Callable[[str], Synthesizer],
) -> ScriptCharacter:
    """Return the character: that of the script, else of the first act, else of the first walk.

    An act meets its targets with its own bones; a walk is at ease with any.
    """
    if question.character is not None:
        chosen = question.character
        with errors_under("character"):
            return _script_character(
                find(chosen.model), chosen.controls, chosen.performer, chosen.labels, models
            )
    segments = list(enumerate(question.segments))
    for kind in (Act, Walk):
        for index, segment in segments:
            model = models[index]
            if isinstance(segment, kind) and model is not None:
                with errors_under("segments", index):
                    return _script_character(model, {}, segment.performer, segment.labels, models)
    raise InvalidField("character", "none, expected one: no segment has a model")


def _script_character(
    model: Synthesizer,
    controls: dict[str, float],
    performer: str | None,
    labels: dict[str, str | dict[str, float]],
    others: Sequence[Synthesizer | None],
) -> ScriptCharacter:
    """Return the character of a model, with limits for the motions of all models of a script."""
    card = model.session.card
    bones = _bones(model, MotionQuestion(controls=controls, performer=performer, labels=labels))
    foot_contacts = [contact for contact in card.contacts if contact.joint in card.feet]
    limits = shared_hinges(card, [other.session.card for other in others if other is not None])
    body, planted, _ = footsteps.choose_limbs(
        card.skeleton.parents,
        bones,
        [contact.joint for contact in foot_contacts],
        (),
        limits,
        card.skeleton.tips,
    )
    contacts = tuple(foot_contacts[index] for index in planted)
    feet = tuple(contact.joint for contact in contacts)
    facing = math.radians(card.making.facing or 0.0)
    return ScriptCharacter(
        model.identity, card.skeleton, card.roles, facing, bones, body, feet, contacts
    )


def _bones(model: Synthesizer, body_question: MotionQuestion) -> Bones:
    """Return bone offsets (J, 3), m, at the controls and labels of a question."""

    def evaluated() -> Bones:
        question = model.question(body_question)
        offsets = stride.bones(model.session, question.point, question.labels)[0].astype(float)
        offsets.flags.writeable = False
        return np.asarray(offsets)

    return _kept_bones.find((model.session.digest, msgspec.json.encode(body_question)), evaluated)


_kept_bones: ValueCache[tuple[str, bytes], Bones] = ValueCache(KEPT_BONES)


def _sources(
    question: PerformanceQuestion,
    models: Sequence[Synthesizer | None],
    character: ScriptCharacter,
) -> Iterator[Source | None]:
    """Yield the sources of the segments; those of equal walkers are made once."""
    sources: dict[tuple[str, str | None, bytes], Source] = {}
    for index, (segment, model) in enumerate(zip(question.segments, models, strict=True)):
        if model is None or isinstance(segment, Hold):
            yield None
            continue
        key = (model.identity, segment.performer, msgspec.json.encode(segment.labels))
        if key not in sources:
            sources[key] = _source(index, segment, model, character)
        yield sources[key]


def _source(
    index: int, segment: Walk | Act, model: Synthesizer, character: ScriptCharacter
) -> Source:
    """Return the model of a segment as a source of the character's poses."""
    card, field = model.session.card, f"segments/{index}/model"
    try:
        match = match_skeletons(card.skeleton, character.skeleton, character.feet)
    except SkeletonsDiffer as fault:
        raise InvalidField(
            field, f"{card.name} has another skeleton than {character.identity}: {fault}"
        ) from fault
    feet = _feet(field, card, character)
    whose = MotionQuestion(controls={}, performer=segment.performer, labels=segment.labels)
    model_bones = _bones(model, whose)
    share = leg_share(card.skeleton.parents, model_bones, character.bones, character.feet)
    with errors_under("segments", index):
        walks = model.gait if card.cyclic else None
    return Source(model, match, share, feet, walks)


def _feet(field: str, card: ModelCard, character: ScriptCharacter) -> tuple[int, ...]:
    """Return the columns of the character's feet in the contacts of a model's passages."""
    # Walks have the contacts that the model knows; acts detect those that it does not.
    contact_joints = [contact.joint for contact in walking_feet.foot_contacts(card)]
    columns = contact_joints if card.cyclic else list(card.feet)
    absent = [joint for joint in character.feet if joint not in columns]
    if absent:
        raise InvalidField(
            field,
            f"{card.name} knows no contacts of {card.skeleton.names[absent[0]]!r}, expected those "
            f"of the feet of {character.identity}",
        )
    return tuple(columns.index(joint) for joint in character.feet)


def shared_hinges(card: ModelCard, others: Sequence[ModelCard]) -> tuple[Hinge, ...]:
    """Return the hinges of a character's model, whose ranges include those of other models.

    Empty where one of the models has none, or another skeleton.
    """
    widened = list(card.hinges)
    for other in {own.name: own for own in others}.values():
        try:
            match = match_skeletons(other.skeleton, card.skeleton)
        except SkeletonsDiffer:
            return ()
        known = {hinge.joint: hinge for hinge in other.hinges}
        widened = [
            _widened(hinge, known[hinge.joint], match) for hinge in widened if hinge.joint in known
        ]
    return tuple(widened)


def _widened(hinge: Hinge, other: Hinge, match: SkeletonMatch) -> Hinge:
    """Return a hinge whose range includes that of the same joint in a skeleton that it matches."""
    rotations = np.tile(quat.IDENTITY, (len(match.parents), 1))
    rotations[other.joint] = other.reference
    # The straight limb of the other skeleton is bent a little by the hinge of this one.
    shift = hinges.from_card((hinge,)).angles(match.rotations(rotations))[0]
    return replace(
        hinge,
        low=hinges.rounded(np.minimum(hinge.low, other.low + shift)),
        high=hinges.rounded(np.maximum(hinge.high, other.high + shift)),
    )
