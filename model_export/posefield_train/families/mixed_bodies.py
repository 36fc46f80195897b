"""Families of several kinds of bodies: whether they share a topology, and their report."""

from collections.abc import Sequence
from dataclasses import replace

from posefield.roles.joint_recognition import RoleGuess
from posefield_train.families.body_kinds import STATED, BodyKind
from posefield_train.probe import recipe_draft
from posefield_train.probe.probe_report import ProbeReport
from posefield_train.probe.proposals import Proposal
from posefield_train.source import common_topology
from posefield_train.source.common_topology import RoleJoints, TopologyError

SAME_UNIT = 1e-4
"""Largest relative difference of two numbers that state the same unit."""


def can_share(kinds: Sequence[BodyKind]) -> bool:
    """Return whether bodies have all roles of a common topology, and one unit and up axis."""
    units, axes = (
        [own.report.proposed[key].value for own in kinds] for key in ("metres_per_unit", "up")
    )
    if max(units) - min(units) > SAME_UNIT * max(units) or len(set(axes)) > 1:
        return False
    try:
        _bodies(kinds)
    except TopologyError:
        return False
    return True


def _bodies(kinds: Sequence[BodyKind]) -> list[RoleJoints]:
    return [
        common_topology.role_joints(
            own.skeleton, {role: [joint] for role, joint in own.stated.items()}
        )
        for own in kinds
    ]


def shared_report(report: ProbeReport, kinds: Sequence[BodyKind]) -> ProbeReport:
    """Return a report on bodies of which a recipe makes one topology.

    report: on those of the most common kind, whose joints become those of the topology.
    """
    names = common_topology.common_topology(_bodies(kinds)).names
    guesses = {
        role: RoleGuess(joint, 1.0) for role, joint in common_topology.model_roles(names).items()
    }
    by_joint = {joint: role for role, joint in report.roles.items()}
    feet = report.proposed["feet"]
    named = [by_joint[joint] for joint in feet.value if by_joint.get(joint) in names]
    proposed = report.proposed | {
        "feet": replace(feet, value=named),
        "facing": Proposal(0.0, "certain", ("bodies on the topology of roles face +z",)),
    }
    return replace(report, joints=names, guesses=guesses, proposed=proposed)


def skeleton_lines(kinds: Sequence[BodyKind]) -> list[str]:
    """Return the section [skeleton] of a family's recipe, with its evidence as comments."""
    counts = ", ".join(str(len(own.joints)) for own in kinds)
    lines = [
        f"# The files have {len(kinds)} kinds of skeletons, of {counts} joints: clips get the",
        "# joints of the roles that all have, named by their roles.",
        "[skeleton]",
        'topology = "roles"',
    ]
    stated: dict[str, list[str]] = {}
    for own in kinds:
        for role, joint in own.stated.items():
            known = stated.setdefault(role, [])
            known += [] if joint in known else [joint]
    if stated:
        lines += ["", f"# {STATED[0]}", "[skeleton.roles]"]
        lines += [f"{role} = {recipe_draft.names(joints)}" for role, joints in stated.items()]
    return [*lines, ""]
