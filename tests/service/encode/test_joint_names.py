from itertools import product

from posefield.encode import character


def test_illegal_characters_become_underscores():
    given = ["mixamorig:Hips", "Bip001-Pelvis", "Left Leg", "1Head", "", "左"]
    expected = ("mixamorig_Hips", "Bip001_Pelvis", "Left_Leg", "_1Head", "_", "__2")
    assert character.legal_names(given) == expected


def test_names_that_meet_are_numbered_and_the_legal_one_keeps_its_own():
    assert character.legal_names(["a b", "a-b", "a_b", "a_b_2"]) == (
        "a_b_3",
        "a_b_4",
        "a_b",
        "a_b_2",
    )


def test_any_names_become_legal_and_unique():
    given = ["".join(letters) for letters in product("a_1 :é", repeat=3)] + [""]
    found = character.legal_names(given)
    assert len(set(found)) == len(given)
    assert all(character.LEGAL_NAME.fullmatch(name) for name in found)
    assert character.legal_names(given) == found


def test_a_path_holds_every_ancestor():
    assert character.joint_paths(["a", "b", "c", "d"], [-1, 0, 1, 0]) == (
        "a",
        "a/b",
        "a/b/c",
        "a/d",
    )
