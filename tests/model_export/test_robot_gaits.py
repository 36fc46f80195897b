"""Tests of the doctor on gaits of the example: their cycles, and feet that stand."""

import runpy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from posefield.robots import robot_formats
from posefield.robots.file_conventions import Conventions
from posefield_train.robots import cycle_search, doctor, robot_file

EXAMPLE = runpy.run_path(str(Path(__file__).parents[2] / "examples/biped_gaits.py"))
CYCLE = 40
"""Frames of a cycle of the example."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("gaits") / "biped"
    EXAMPLE["main"](path)
    return path


@pytest.fixture(scope="module")
def robot(folder):
    return robot_file.read(folder / "biped.xml")


def test_gaits_of_the_example_stand_and_follow_their_commands(folder, robot):
    rows = (folder / "clips.csv").read_text().splitlines()[1:]
    assert len(rows) == EXAMPLE["COUNT"]
    for row in rows[::12]:
        name, *command = row.split(",")
        motion = robot_formats.read(folder / name, Conventions(robot))
        assert not doctor.diagnose(motion, robot).findings
        forward, left, turning = map(float, command)
        turn = 2.0 * np.arctan2(motion.base_rotations[-1, 3], motion.base_rotations[-1, 0])
        assert turn == pytest.approx(turning * motion.duration)
        way = np.linalg.norm((motion.base_path[-1] - motion.base_path[0])[:2])
        arc = np.hypot(forward, left) * motion.duration
        assert way == pytest.approx(arc, rel=0.2, abs=0.01)


def test_feet_that_stand_do_not_slide_in_slow_low_or_noisy_gaits(robot, monkeypatch):
    """Control: the same gaits carried sideways at 8 cm/s, of which both feet are told."""
    rng = np.random.default_rng(0)
    for command in np.array([[0.0, 0.0, 0.0], [0.05, 0.0, 0.0], [0.0, 0.1, 0.0], [0.4, 0.0, 0.0]]):
        for lift, noise in ((0.015, 0.0), (0.05, 0.003)):
            monkeypatch.setitem(EXAMPLE["gait"].__globals__, "LIFT", lift)
            motion = replace(EXAMPLE["gait"](command), loops=None)
            angles = motion.angles + noise * rng.normal(size=motion.angles.shape)
            carried = motion.base_path + np.arange(len(motion))[:, None] * [0, 0.08 / 50, 0]
            for path, slides in ((motion.base_path, []), (carried, [8.0, 8.0])):
                moved = replace(motion, angles=angles, base_path=path)
                findings = doctor.diagnose(moved, robot).findings
                speeds = [finding.value for finding in findings if finding.kind == "skating"]
                assert speeds == pytest.approx(slides, rel=0.25)


def at(motion, frames, noise=0.0):
    """A motion at frames of a cycle that repeats, whose file does not say so."""
    rows, ahead = frames.astype(int) % CYCLE, (frames % 1.0)[:, None]
    path, angles = (
        (1 - ahead) * values[rows] + ahead * values[rows + 1]
        for values in (motion.base_path, motion.angles)
    )
    angles += noise * np.random.default_rng(0).normal(size=angles.shape)
    rotations = motion.base_rotations[rows]
    return replace(motion, base_path=path, base_rotations=rotations, angles=angles, loops=None)


def test_cycles_begin_in_one_phase_in_gaits_either_way(robot):
    shifts = np.array([0, 7, 22, 39, 11])
    commands = [(0.3, 0, 0), (-0.15, 0, 0.4), (0, 0.1, 0), (0.1, -0.1, -0.5), (0, 0, 0)]
    motions = [
        at(EXAMPLE["gait"](np.array(command)), np.arange(first, 200.0), noise=0.002)
        for command, first in zip(commands, shifts, strict=True)
    ]
    cycles = cycle_search.find(motions, robot)
    phases = np.array([cycle.first for cycle in cycles]) + shifts
    np.testing.assert_allclose((phases + CYCLE / 2) % CYCLE, CYCLE / 2, atol=1)
    for cycle in cycles:
        assert (cycle.last - cycle.first, cycle.count, type(cycle.seconds)) == (CYCLE, 1, float)
        assert (cycle.seconds, cycle.gap) == pytest.approx((0.8, 0.0), abs=0.004)


def test_cycles_of_whole_files_are_told_two_of_half_frames_and_none_of_what_does_not_repeat(robot):
    gait = EXAMPLE["gait"](np.array((0.2, 0, 0)))
    (cycle,) = cycle_search.find([at(gait, np.arange(150) * (CYCLE / 33.5))], robot)
    assert (cycle.last - cycle.first, cycle.count) == (67, 2)
    assert cycle.seconds == pytest.approx(33.5 / gait.rate, abs=0.004)
    frames = np.arange(CYCLE + 1.0), np.arange(CYCLE - 8.0), np.full(90, 3.0)
    cycles = cycle_search.find([at(gait, each) for each in frames], robot)
    assert (cycles[0].first, cycles[0].last) == (0, CYCLE)
    assert cycles[1:] == [None, None]


def test_the_doctor_writes_the_table_of_a_recipe(folder, posefield):
    table = folder / "cycles.csv"
    words = ["doctor", *sorted(folder.glob("gaits/*.json"))[:14], "--robot", folder / "biped.xml"]
    code, out, _ = posefield(*words, "--table", table)
    assert code == 0 and "cycle: 0.800 s; frames 0 to 40 hold one, open by 0.00 degrees" in out
    lines = table.read_text().splitlines()
    assert len(lines) == 15
    assert lines[:2] == ["file,first_frame,last_frame", "gaits/00.json,0,40"]
    code, _, errors = posefield(*words, "--table", table)
    assert code and "exists already" in errors
    code, _, errors = posefield("init", folder / "gaits")
    assert code and "if 00.json is of a robot, see posefield doctor --table" in errors
