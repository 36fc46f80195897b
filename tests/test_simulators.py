"""Recorded outputs of SUMO and JuPedSim, animated: people are where the simulators have them."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from osi_utilities import MessageType
from osi_utilities.tracefile.readers.single import SingleTraceReader

from posefield.tracks import track_files

pytestmark = pytest.mark.system
DATA = Path(__file__).parent / "data"
FPS = 20.0


def animated(recording, folder):
    """Return the report, and by person and time the centre and the velocity of its box (2, 3)."""
    trace = folder / "people_gt.osi"
    words = ["crowd", "cmu_walk", "--trajectories", str(DATA / recording), "--skip-bad", "--json"]
    words += ["--take", "index", "--fps", f"{FPS:g}", "-o", str(trace)]
    result = subprocess.run(
        [sys.executable, "-m", "posefield", *words], check=True, capture_output=True, text=True
    )
    reader, people = SingleTraceReader(), {}
    reader.set_message_type(MessageType.GROUND_TRUTH)
    assert reader.open(trace)
    with reader:
        for message in (item.message for item in reader):
            time = message.timestamp.seconds + 1e-9 * message.timestamp.nanos
            for thing in message.moving_object:
                assert len(thing.pedestrian_attributes.skeleton_bone) == 20
                rows = [
                    [vector.x, vector.y, vector.z]
                    for vector in (thing.base.position, thing.base.velocity)
                ]
                person = thing.source_reference[0].identifier[0]
                people.setdefault(person, []).append((time, np.array(rows)))
    return json.loads(result.stdout), people


@pytest.mark.parametrize(
    ("recording", "count", "mean"),
    [("sumo_corner.xml", 60, 0.10), ("jupedsim_corridor.sqlite", 18, 0.05)],
)
def test_people_are_where_the_simulator_has_them(recording, count, mean, tmp_path):
    report, people = animated(recording, tmp_path)
    tracks = track_files.read_tracks(DATA / recording, skip_bad=True).tracks
    assert len(people) + len(report["skipped"]) == count
    assert len(people) >= 0.9 * count
    distances, errors, speeds = [], [], []
    for track in tracks:
        times, values = zip(*people[track.person], strict=True)
        boxes = np.array(values)
        assert times[0] == pytest.approx(track.times[0], abs=1.0 / FPS)
        points = np.interp(times, track.times, track.points)
        # Points over the floor are forward and to the left: -y and x of the file.
        places = -boxes[:, 0, 1] + 1j * boxes[:, 0, 0]
        distances.append(np.abs(places - points))
        differences = 0.5 * FPS * (boxes[2:, 0] - boxes[:-2, 0])
        errors.append(np.linalg.norm(boxes[1:-1, 1] - differences, axis=1))
        speeds.append(np.linalg.norm(differences, axis=1))
    assert np.concatenate(distances).mean() < mean
    assert np.concatenate(errors).max() < 0.002 * np.concatenate(speeds).max()
    # A mirrored world would be metres away.
    assert np.abs(np.conj(places) - points).mean() > 10.0 * mean
