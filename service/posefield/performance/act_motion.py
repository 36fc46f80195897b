"""Acts: motions of models without cycles, sampled through the moment of their event."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from posefield.common.errors import InvalidField
from posefield.common.units import Bones, Floats, Frames
from posefield.constraints import take_variation
from posefield.constraints.targets import NO_CONSTRAINTS
from posefield.feet import limbs, stance_rows
from posefield.inference.onnx_runtime import CONTACTS
from posefield.locomotion import floor_plane
from posefield.motion import measures, quat, skeleton
from posefield.motion.measures import Measure
from posefield.performance.passage import RATE, FloorMotion, Passage
from posefield.question.motion_question import MotionQuestion, PoseQuestion, TargetTime
from posefield.question.results import PoseAnswer, Trust
from posefield.synthesis import poses
from posefield.synthesis.synthesizer import Synthesizer
from posefield.validation.question_validation import ValidatedQuestion


@dataclass(frozen=True)
class Act:
    """Motion of an act in the frame of its segment: its first pose is near the origin.

    bones: offsets (J, 3), m. event: frame of the model's event; None for a model without one.
    trust: of the motion, with the results of its constraints. begins: time of the first frame from
    the start of the model's clip, s.
    """

    passage: Passage
    bones: Bones
    event: int | None
    trust: Trust
    begins: float = 0.0

    @property
    def heading(self) -> float:
        """Heading of the root in the first frame, rad."""
        return self.passage.heading()

    def motion_to(
        self, position: complex, facing: float, point: complex | None = None
    ) -> FloorMotion:
        """Return the motion after which a point of the act is at a place of the floor, facing.

        position: forward is its real part, left its imaginary part, m. facing: heading of the first
        frame, rad. point: in the frame of the segment; None for the first frame's root.
        """
        turn = facing - self.heading
        if point is None:
            point = complex(floor_plane.project(self.passage.roots[0]))
        return FloorMotion(turn, complex(position - np.exp(1j * turn) * point))

    def frame_of(self, when: TargetTime, parents: tuple[int, ...], joint: int) -> int:
        """Return the frame of a target of a joint: at a time, s, of the clip, or at a moment."""
        last = len(self.passage) - 1
        if isinstance(when, int | float):
            return min(max(round((when - self.begins) * RATE), 0), last)
        if when == "event":
            return last if self.event is None else self.event
        translations = skeleton.translations(self.bones, self.passage.roots)
        paths = skeleton.positions(parents, self.passage.rotations, translations)
        return round(measures.moment_frame(Measure("height", (joint,), when), paths, 0.0))


def act_passage(model: Synthesizer, act_question: MotionQuestion) -> Act:
    """Return the act of a question in the frame of its segment.

    Its frames are those of `RATE` that pass through the event, or through the end where the model
    has no event; less than a frame is lost at either end. Feet are as predicted. Raises
    InvalidField for a cyclic model, and as `poses.synthesize_poses` does.
    """
    card = model.session.card
    if card.cyclic:
        raise InvalidField("act", f"{model.name} is a cycle, expected a model of another motion")
    question = model.question(act_question)
    duration, duration_factor = _duration(model, question, act_question)
    times, event = _times(model, question, duration, duration_factor)
    fields = {name: getattr(act_question, name) for name in MotionQuestion.__struct_fields__}
    answer = poses.synthesize_poses(model, PoseQuestion(**fields, times=times.tolist()))
    passage = Passage(
        quat.normalize(answer.rotations.astype(np.float64)),
        answer.root_position.astype(np.float64),
        _contacts(model, question, answer, duration_factor),
        np.full(len(times), answer.trust.sigma),
    )
    return Act(
        passage,
        answer.bone_offsets.astype(np.float64),
        None if card.event is None else event,
        answer.trust,
        float(times[0]),
    )


def times_through(moment: float, duration: float) -> tuple[Frames, int]:
    """Return times (F,), s, within a clip at `RATE` of which one is the moment, and its frame.

    Raises InvalidField for a clip of less than two frames.
    """
    # Tolerance of a millionth of a frame for the rounding of products.
    before, after = (int(span * RATE + 1e-6) for span in (moment, duration - moment))
    if before + after < 1:
        raise InvalidField("act", f"a motion of {duration:.3g} s, expected at least two frames")
    times = moment + np.arange(-before, after + 1) / RATE
    return np.clip(times, 0.0, duration), before


def _duration(
    model: Synthesizer, question: ValidatedQuestion, act_question: MotionQuestion
) -> tuple[float, float]:
    """Return the duration of an act, s, and the share of it by which a take lengthens it."""
    (durations,) = model.session.run(
        question.point, None, "duration", labels=question.labels, level=question.level
    )
    predicted, take = float(durations[0]), take_variation.settings(model.session.card, act_question)
    duration_factor = model.solver.variation.duration_factor(take, predicted) if take else 1.0
    return model.check_duration(predicted * duration_factor), duration_factor


def _times(
    model: Synthesizer, question: ValidatedQuestion, duration: float, duration_factor: float
) -> tuple[Frames, int]:
    """Return the times (F,), s, of an act's frames, and the frame of the event, or the last."""
    event, last = model.session.card.event, model.session.card.frames - 1
    if event is None or event.share == 1.0:
        return times_through(duration, duration)
    motion = model.solver.solve(question, NO_CONSTRAINTS)
    (moment,) = model.solver.times(question, motion, np.array([event.share * last]))
    return times_through(float(moment) * duration_factor, duration)


def _contacts(
    model: Synthesizer, question: ValidatedQuestion, answer: PoseAnswer[Any], duration_factor: float
) -> Annotated[Floats, "frames feet"]:
    """Return the probabilities (F, K) that the feet of the card contact the ground.

    Contacts of a foot of which the model knows none are detected in the motion.
    """
    card = model.session.card
    contacts = np.zeros((len(answer.times), len(card.feet)))
    columns = {contact.joint: column for column, contact in enumerate(card.contacts)}
    if columns:
        (likely,) = model.session.run(
            question.point,
            answer.times[None] / duration_factor,
            CONTACTS,
            labels=question.labels,
            level=question.level,
        )
    unknown_joints = [joint for joint in card.feet if joint not in columns]
    # Without a foot to detect, no joint is placed.
    motion = answer.bone_offsets, unknown_joints, answer.rotations, answer.root_position
    placed = limbs.evaluate_joints(card.skeleton.parents, *motion) if unknown_joints else None
    for foot, joint in enumerate(card.feet):
        if joint in columns:
            contacts[:, foot] = likely[0][:, columns[joint]]
        elif placed is not None:
            contacts[:, foot] = stance_rows.detect(placed.position(joint), RATE)
    return contacts


def _no_goal(angle: float) -> FloorMotion:
    raise TypeError("an act without a goal, expected one that may face any way")


@dataclass(frozen=True)
class StagedAct:
    """An act and its place.

    segment: its index. by: motion that places it; None for any place, or for any heading at its
    goal. facing: returns the motion for a heading of the first frame, rad, at the goal. adapted:
    its passage as one of the character, if it is known.
    """

    segment: int
    act: Act
    by: FloorMotion | None
    goal: complex = 0j
    facing: Callable[[float], FloorMotion] = _no_goal
    adapted: Passage | None = None
