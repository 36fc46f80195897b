"""Delivery of motions to a user's character: retargeted, reported and written to files."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from msgspec import structs

from posefield.characters.user_character import FileAxes, UserCharacter
from posefield.common.errors import InvalidField
from posefield.encode.character import Convention
from posefield.encode.formats import ClipEncoder
from posefield.motion import quat
from posefield.motion.clip import Clip
from posefield.motion.skeleton import Skeleton
from posefield.question.motion_question import ClipQuestion, Target
from posefield.question.performance_question import PerformanceLayout, PerformanceQuestion
from posefield.question.performance_report import HeldJoint, PerformanceAnswer, ScriptWarning
from posefield.question.results import ClipAnswer, FeetResult, SampledClip, StanceResult
from posefield.retarget import role_map
from posefield.retarget.retargeting import HandGoal, Travel, retarget

ARM = ("UpperArm", "LowerArm", "Hand")
CLOSED = 1e-3
"""Largest distance of a joint between both ends of a loop that is not told, m."""
NO_GOAL = (
    "the target of {} is met by the body of the model: of a character, only hands with arms do"
)
POINTER = "/character"
"""Place of the warnings about a character among those of a script."""


@dataclass(frozen=True)
class Delivery:
    """Delivery of motions to a character in one format. convention: of its files."""

    character: UserCharacter
    form: ClipEncoder
    convention: Convention

    @property
    def joints(self) -> int:
        """Return the number of joints of the character."""
        return len(self.character.rig.skeleton)

    def clip(
        self, answer: ClipAnswer, question: ClipQuestion, roles: Mapping[str, str]
    ) -> ClipAnswer:
        """Return a clip of a model as one of the character, with the report in its trust.

        roles: joint of the model by role. Raises InvalidField for a model without legs.
        """
        trust = answer.trust
        hands, unmet_targets = _hand_goals(answer.clip, question.targets, self._hands(roles))
        travel: Travel = "kept" if question.targets else "scaled"
        stances = _stances(trust.feet, question)
        clip, facts, warnings = self._retargeted(answer.clip, roles, stances, hands, travel)
        if question.loop:
            unmet_targets += _loop_note(clip)
        notes = (*warnings, *unmet_targets, *self.character.notes(self.form, clip))
        told_trust = structs.replace(trust, warnings=(*trust.warnings, *notes), retargeting=facts)
        return ClipAnswer(clip, told_trust)

    def performance(self, answer: PerformanceAnswer, roles: Mapping[str, str]) -> PerformanceAnswer:
        """Return a performance as one of the character, with the retargeting in its report.

        roles: joint of the character of the script by role. Places of the script stay where they
        are in the world.
        """
        report = answer.trust
        stances = None if report.feet is None else report.feet.stances
        hands, unmet_targets = _held_hands(answer.held, self._hands(roles))
        clip, facts, new_warnings = self._retargeted(answer.clip, roles, stances, hands, "kept")
        notes = (*new_warnings, *unmet_targets, *self.character.notes(self.form, clip))
        warnings = tuple(ScriptWarning(POINTER, sentence) for sentence in notes)
        delivered = structs.replace(
            report, script_warnings=(*report.script_warnings, *warnings), retargeting=facts
        )
        return PerformanceAnswer(clip, delivered)

    def check(
        self,
        question: ClipQuestion | PerformanceQuestion,
        skeleton: Skeleton,
        roles: Mapping[str, str],
    ) -> None:
        """Raise InvalidField for a question whose answer cannot be delivered.

        skeleton, roles: of the model, joints by role.
        """
        self.character.check(question)
        role_map.body_of_motion(skeleton, skeleton.offsets, roles)

    def check_layout(self, layout: PerformanceLayout) -> None:
        """Raise InvalidField for a layout that files of a character do not have."""
        if layout != "whole":
            raise InvalidField("layout", f"{layout!r} with a character, expected 'whole'")

    def encode(self, answer: SampledClip) -> bytes:
        """Return the file of a motion of the character."""
        return self.character.encode(self.form, answer, self.convention)

    def _hands(self, roles: Mapping[str, str]) -> dict[str, str]:
        """Return the role of each joint of the model that is a hand which the character has."""
        joints = self.character.rig.joints
        arms = {side + "Hand": {side + segment for segment in ARM} for side in role_map.SIDES}
        return {
            roles[hand]: hand
            for hand, arm in arms.items()
            if hand in roles and arm <= joints.keys()
        }

    def _retargeted(
        self,
        clip: Clip,
        roles: Mapping[str, str],
        stances: Sequence[StanceResult] | None,
        hands: Sequence[HandGoal],
        travel: Travel,
    ) -> tuple[Clip, dict[str, Any], tuple[str, ...]]:
        """Return the motion of the character, the facts of the report, and its warnings."""
        character = self.character
        retargeted, report = retarget(
            clip, character.rig, roles, stances=stances, hands=hands, travel=travel
        )
        facts = {"character": character.name, "file": character.file, **report.facts()}
        bone = clip.root_bone or character.has_floor_root
        retargeted = replace(retargeted, root_bone=bone, roles=character.rig.joints)
        return retargeted, facts, tuple(facts.pop("warnings"))


def deliver(character: UserCharacter, form: ClipEncoder, axes: FileAxes) -> Delivery:
    """Return the delivery of answers in files of a format.

    Raises InvalidField for what the files of a character cannot hold.
    """
    return Delivery(character, form, character.convention(form, axes))


def _stances(feet: FeetResult | None, question: ClipQuestion) -> Sequence[StanceResult] | None:
    """Return the stances in the time of a clip; none for feet that slide in place."""
    if question.root == "in_place":
        return ()
    if feet is None:
        return None
    start = question.start
    return [
        replace(stance, begin=stance.begin - start, end=stance.end - start)
        for stance in feet.stances
    ]


def _held_hands(
    held_joints: Sequence[HeldJoint], hand_roles: Mapping[str, str]
) -> tuple[list[HandGoal], list[str]]:
    """Return the targets of hands as goals while they are held, and sentences on others.

    hand_roles: role of each joint that is a hand.
    """
    goals = [
        HandGoal(
            hand_roles[held_joint.joint],
            held_joint.begins,
            np.array(held_joint.position),
            held_joint.ends,
        )
        for held_joint in held_joints
        if held_joint.joint in hand_roles
    ]
    unmet_joints = dict.fromkeys(
        held_joint.joint for held_joint in held_joints if held_joint.joint not in hand_roles
    )
    return goals, [NO_GOAL.format(joint) for joint in unmet_joints]


def _hand_goals(
    clip: Clip, targets: Sequence[Target], hand_roles: Mapping[str, str]
) -> tuple[list[HandGoal], list[str]]:
    """Return the targets of hands as goals, and a sentence for each other target.

    hand_roles: role of each joint that is a hand.

    A goal is at the frame in which the joint of the model is nearest to the target, its moment.
    """
    goals, notes = [], []
    positions = clip.positions() if targets else None
    for target in targets:
        if target.joint not in hand_roles or positions is None:
            notes.append(NO_GOAL.format(target.joint))
            continue
        position = np.array(target.position)
        distances = np.linalg.norm(
            positions[:, clip.skeleton.names.index(target.joint)] - position, axis=-1
        )
        goals.append(
            HandGoal(hand_roles[target.joint], float(np.argmin(distances)) / clip.rate, position)
        )
    return goals, notes


def _loop_note(clip: Clip) -> list[str]:
    """Return a sentence if the last pose of a loop is not the first, as seen from the root."""
    boundary = clip.part([0, -1])
    boundary.rotations[:, 0], boundary.translations[:, 0] = quat.IDENTITY, 0.0
    first, last = boundary.positions()
    distance = float(np.linalg.norm(last - first, axis=-1).max())
    if distance <= CLOSED:
        return []
    return [f"the last pose of the loop differs from the first by {1000.0 * distance:.1f} mm"]
