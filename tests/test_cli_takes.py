"""Tests of the command line: poses, clips and exports of takes."""

import csv
import json


def test_a_take_is_the_same_in_every_run_and_another_clip_than_the_mean(
    posefield, walk_path, tmp_path
):
    made = {name: tmp_path / f"{name}.bvh" for name in ("mean", "zero", "one", "again", "other")}
    words = {"mean": [], "zero": ["--take", "0"], "other": ["--take", "8"]}
    for name, path in made.items():
        taken = words.get(name, ["--take", "7"])
        assert posefield("clip", walk_path, "-o", path, *taken)[0] == 0
    contents = {name: path.read_bytes() for name, path in made.items()}
    assert contents["mean"] == contents["zero"] and contents["one"] == contents["again"]
    assert len({contents["mean"], contents["one"], contents["other"]}) == 3


def test_variety_and_detail_are_options(posefield, walk_path):
    code, out, err = posefield("pose", walk_path, "--take", "7", "--variety", "0.2", "--detail")
    assert code == 0 and "warning: detail: this model's file has none to sample\n" in err
    plain = json.loads(posefield("pose", walk_path, "--take", "7")[1])
    assert json.loads(out)["rotations"] != plain["rotations"]


def test_what_is_out_of_range_is_refused(posefield, walk_path):
    code, out, err = posefield("pose", walk_path, "--take", "-1")
    assert (code, out) == (2, "") and err.startswith("posefield: take: -1, expected 0 to 999999999")


def test_an_export_has_a_take_for_each_row(posefield, walk_path, tmp_path):
    table, made = tmp_path / "q.csv", tmp_path / "made"
    controls = json.loads(posefield("pose", walk_path)[1])["trust"]["controls"]
    with table.open("w", newline="") as file:
        writer = csv.DictWriter(file, [*controls, "take", "name"])
        writer.writeheader()
        rows = {"mean": "", "one": 7, "again": 7, "other": 8}
        writer.writerows(controls | {"take": take, "name": name} for name, take in rows.items())
    words = ("export", walk_path, table, "-o", made, "--workers", "1", "--format", "bvh")
    assert posefield(*words)[0] == 0
    mean, one, again, other = (next(made.rglob(f"{name}.bvh")).read_bytes() for name in rows)
    assert one == again and len({mean, one, other}) == 3
