"""Tests of joint names of conventions: unique names, with all else unchanged."""

from typing import get_args

import numpy as np
import pytest

from posefield.common.errors import InvalidField
from posefield.motion import joint_roles
from posefield.motion.joint_roles import NamingConvention
from posefield.motion.skeleton import Skeleton

CONVENTIONS = [names for names in get_args(NamingConvention) if names != "own"]


def chain(*names):
    count = len(names)
    return Skeleton(names, (-1, *range(count - 1)), np.zeros((count, 3)), (), np.zeros((0, 3)))


def test_every_convention_has_a_name_of_its_own_for_every_role():
    assert set(joint_roles.NAMES_BY_CONVENTION) == set(CONVENTIONS)
    for table in joint_roles.NAMES_BY_CONVENTION.values():
        assert tuple(table) == joint_roles.ROLES
        assert len(set(table.values())) == len(joint_roles.ROLES) == 22


def test_names_that_a_convention_takes_are_left_to_it():
    """CMU's spine is shifted by one: LowerBack, Spine, Spine1 become Spine, Spine1, Spine2."""
    given = chain("Hips", "LowerBack", "Spine", "Spine1", "Neck")
    cast = {"spine": "LowerBack", "chest": "Spine", "upperChest": "Spine1"}
    assert joint_roles.rename_joints(given, cast, "humanik").names == (
        "Hips",
        "Spine",
        "Spine1",
        "Spine2",
        "Neck",
    )


def test_a_joint_whose_name_was_taken_gets_an_ending_that_nobody_has():
    given = chain("hips", "Spine", "Spine_2", "low")
    assert joint_roles.rename_joints(given, {"spine": "low"}, "humanik").names == (
        "hips",
        "Spine_3",
        "Spine_2",
        "Spine",
    )


def test_without_roles_a_convention_is_refused():
    with pytest.raises(InvalidField) as caught:
        joint_roles.rename_joints(chain("a"), {}, "mixamo")
    assert caught.value.field == "names"
    assert "expected 'own': this model's recipe gives its joints no [roles]" in str(caught.value)
