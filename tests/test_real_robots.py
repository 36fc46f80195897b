"""Tests of the doctor on reference motions of other programs."""

import zipfile
from dataclasses import replace

import numpy as np
import pytest

from posefield.common.errors import MotionFileError
from posefield.robots import robot_formats
from posefield.robots.file_conventions import Conventions
from posefield_train.robots import doctor, robot_file

pytestmark = pytest.mark.system

# Format by the folder of the file, and a part of its name; None for a file that is refused.
FORMATS = {
    "asap_pkl": "asap.pkl",
    "holosoma_npz": "holosoma.npz",
    "locomujoco_npz": "locomujoco.npz",
    "motion_visualization": "tienkung.txt",
    "deepmimic_txt": "amp.txt",
    "motion_amp_expert": None,
    "kimodo_npz": None,
}


@pytest.fixture(scope="module")
def files(real_data, tmp_path_factory):
    folder = tmp_path_factory.mktemp("robots")
    for name in ("robot_files.zip", "robot_go_bdx.zip"):
        with zipfile.ZipFile(real_data / name) as packed:
            packed.extractall(folder)
    return folder


def test_files_of_other_programs_are_recognised_or_refused_with_the_way_out(files):
    motions = [
        path
        for path in sorted((files / "robot_files").rglob("*.*"))
        if path.suffix in robot_formats.SUFFIXES and "LICENSE" not in path.name
    ]
    assert len(motions) > 30
    stated = Conventions(rate=60.0, quaternions="xyzw")
    for path in motions:
        expected = next(name for part, name in FORMATS.items() if part in str(path))
        if expected:
            assert robot_formats.read(path, stated).format == expected
        else:
            with pytest.raises(MotionFileError, match="expected the"):
                robot_formats.read(path, stated)


def test_gaits_of_a_biped_stand_within_limits_and_an_altered_one_is_found(files):
    folder = files / "robot_go_bdx"
    robot = robot_file.read(folder / "go_bdx.xml")
    assert [robot.bodies[foot.body] for foot in robot.feet] == ["left_foot_link", "right_foot_link"]
    gaits = sorted((folder / "gaits").glob("*.json"), key=lambda path: int(path.stem))
    motions = [robot_formats.read(path, Conventions(robot)) for path in gaits]
    kinds = {finding.kind for finding in doctor.diagnose(motions[1], robot).findings}
    assert kinds == {"seam"}
    sound = set(doctor.outliers(motions))
    assert len(sound) <= 2
    offset = np.radians(10.0) * (np.arange(16) == robot.hinges.index("left_knee"))
    motions[7] = replace(motions[7], angles=motions[7].angles + offset)
    found = doctor.outliers(motions)
    assert found[7].where == "left_knee"
    assert len(set(found) - sound - {7}) <= 1
