"""Motion files are found in folders and in zips, and nowhere else."""

import pickle
import zipfile

import pytest

from model_export import data
from service.motion.errors import RecipeError

NAME = "takes/bvh/walk.bvh"


def write_zip(path, entries):
    with zipfile.ZipFile(path, "w") as archive:
        for name in entries:
            archive.writestr(name, f"content of {name}")


@pytest.fixture(params=["folder", "zip with the top folder", "zip without the top folder"])
def filled(request, tmp_path):
    """A data folder that holds NAME in one of the three ways, and what the file says."""
    if request.param == "folder":
        (tmp_path / NAME).parent.mkdir(parents=True)
        (tmp_path / NAME).write_text("content of a folder")
        return tmp_path, "content of a folder"
    entry = NAME if "without" not in request.param else NAME.partition("/")[2]
    write_zip(tmp_path / "takes.zip", [entry])
    return tmp_path, f"content of {entry}"


def test_a_file_is_found(filled):
    folder, content = filled
    assert data.find(folder, NAME).read_bytes().decode() == content


def test_a_place_can_be_sent_to_another_process(filled):
    folder, content = filled
    place = data.find(folder, NAME)
    sent = pickle.loads(pickle.dumps(place))
    assert (sent, str(sent), sent.name) == (place, str(place), "walk.bvh")
    assert sent.read_bytes().decode() == content


def test_a_folder_goes_before_a_zip(tmp_path):
    write_zip(tmp_path / "takes.zip", [NAME])
    (tmp_path / NAME).parent.mkdir(parents=True)
    (tmp_path / NAME).write_text("unpacked")
    assert data.find(tmp_path, NAME).read_bytes().decode() == "unpacked"


def test_what_is_not_there_is_refused_with_every_place_that_was_tried(tmp_path):
    write_zip(tmp_path / "takes.zip", ["bvh/run.bvh"])
    with pytest.raises(RecipeError, match=r"no file 'takes/bvh/walk\.bvh'") as caught:
        data.find(tmp_path, NAME)
    tried = caught.value.message.partition("tried ")[2].split(", ")
    archive = tmp_path / "takes.zip"
    assert tried == [f"{tmp_path / NAME}", f"{archive}/{NAME}", f"{archive}/bvh/walk.bvh"]


def test_without_a_zip_only_the_folder_was_tried(tmp_path):
    with pytest.raises(RecipeError) as caught:
        data.find(tmp_path, NAME)
    assert caught.value.message.endswith(f"tried {tmp_path / NAME}")


def test_a_folder_is_no_file(filled):
    folder, _ = filled
    with pytest.raises(RecipeError, match="no file"):
        data.find(folder, "takes/bvh")


@pytest.mark.parametrize(
    "name", ["../secret.bvh", "takes/../../secret.bvh", "takes/..", "/etc/hostname", "", "."]
)
def test_paths_that_leave_the_folder_are_refused(tmp_path, name):
    (tmp_path / "data").mkdir()
    (tmp_path / "secret.bvh").write_text("secret")
    with pytest.raises(RecipeError, match="expected a path below the data folder") as caught:
        data.find(tmp_path / "data", name)
    assert repr(name) in caught.value.message


def test_a_zip_entry_cannot_be_reached_by_a_path_that_leaves(tmp_path):
    write_zip(tmp_path / "takes.zip", ["../secret.bvh", "bvh/walk.bvh"])
    with pytest.raises(RecipeError, match="expected a path below"):
        data.find(tmp_path, "takes/../secret.bvh")
    assert data.find(tmp_path, NAME).read_bytes().decode() == "content of bvh/walk.bvh"


def test_a_zip_that_is_none_is_refused_by_name(tmp_path):
    (tmp_path / "takes.zip").write_text("no zip at all")
    with pytest.raises(RecipeError, match=r"takes\.zip: not a zip file"):
        data.find(tmp_path, NAME)
