"""Tests of the command line: files, output and exit codes."""

import json
import re
import stat
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import typer
from rich.text import Text

from posefield import __version__, cli
from posefield.encode.character import Convention
from posefield.encode.formats import CLIP_ENCODERS
from posefield.question.motion_question import ClipQuestion, PoseQuestion
from posefield.registry import model_registry
from posefield.synthesis import clips, poses
from posefield_train.cli import commands
from posefield_train.sample import noise_free
from posefield_train.source import bvh

POINT = {"stature": 1.7, "hip_height": 0.9, "turn": 10.0, "target_height": 1.0}
CONTROLS = [word for name, value in POINT.items() for word in ("-c", f"{name}={value}")]
TALL = ("--performer", "tall")


@pytest.fixture
def refused(posefield):
    """Function that expects the command to fail with a code and one line; gives the line."""

    def of(code, *words):
        found, out, err = posefield(*words)
        assert (found, out) == (code, "")
        *progress, line = err.splitlines()
        assert line.startswith("posefield: ")
        assert all(re.match("motions: [0-9]+ of 92", each) for each in progress)
        return line.removeprefix("posefield: ").strip()

    return of


@pytest.fixture(scope="module")
def quick(reaching_folder, tmp_path_factory):
    """Path of a recipe of few clips and frames."""
    text = (reaching_folder / "recipe.toml").read_text()
    text = re.sub(r'(?s)(\[\[controls\]\]\nname = "stature"|\[presets\.).*?\n\n', "", text)
    text = text.replace("frames = 100", "frames = 8").replace("0.5", "3.0")
    condition = '[clips.where]\nperformer = { among = ["tall"] }\n\n[alignment]\nrounds = 0\n\n'
    path = tmp_path_factory.mktemp("quick") / "quick.toml"
    path.write_text(text.replace("[size]", f"{condition}[size]"))
    return path


def test_it_says_its_version(posefield):
    assert posefield("--version") == (0, f"posefield {__version__}\n", "")


def test_an_application_that_calls_main_twice_registers_commands_once(posefield):
    posefield("--version")
    registered = len(cli.app.registered_commands)
    first, second = posefield("train", "--help"), posefield("train", "--help")
    assert first == second and first[0] == 0
    assert len(cli.app.registered_commands) == registered


def test_help_is_shown_as_it_is_written():
    """Help texts are rich's markup, in which brackets around a word are not shown."""
    assert Text.from_markup("pairs [x, z]").plain == "pairs "
    commands(cli.app)
    found = typer.main.get_command(cli.app).commands
    assert {"crowd", "train"} <= found.keys()
    parts = [each for command in found.values() for each in (command, *command.params)]
    texts = [text for each in parts for text in (each.help, getattr(each, "epilog", "")) if text]
    assert [text for text in texts if Text.from_markup(text).plain != text] == []


@pytest.mark.system
def test_a_process_ends_with_the_code_of_its_fault(tmp_path):
    command = str(Path(sys.executable).parent / "posefield")
    words = [command, "inspect", str(tmp_path / "none.onnx")]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (3, "")
    said = f"posefield: {tmp_path / 'none.onnx'}: cannot be read: No such file or directory\n"
    assert done.stderr == said


# --- why ------------------------------------------------------------------------------------------


def test_why_lists_the_nearest_clips_and_the_others(posefield, labelled_path):
    code, out, err = posefield("why", labelled_path, *CONTROLS, *TALL, "--nearest", 3)
    head, *lines, others, support = out.splitlines()
    assert (code, err, len(lines)) == (0, "", 3)
    assert support.startswith("something like it was captured: variance 0.0")
    assert head.split() == ["clip", "distance", "share", "weight"]
    assert re.fullmatch(
        r"reach_\d+\.bvh +0\.\d{3} +\d+\.\d % +-?\d+\.\d %  (tall|middle|short), stature .*",
        lines[0],
    )
    assert re.fullmatch(r"43 others +\d+\.\d % +-?\d+\.\d %", others)


def test_why_answers_as_json(posefield, labelled_path):
    code, out, err = posefield("why", labelled_path, *CONTROLS[:-1], "target_height=9", "--json")
    found = json.loads(out)
    assert code == 0 and err.startswith("warning: target_height: asked 9 m, given 2.")
    assert err.endswith("; below what was asked\n") and err.count("warning") == 1
    for number in ("weight", "share"):
        each = [clip[number] for clip in found["nearest"]]
        assert len(each) == 10 and found["others"]["count"] == 36
        assert abs(sum(each) + found["others"][number] - 1.0) < 1e-7
    assert min(clip["share"] for clip in found["nearest"]) >= 0.0


def test_sigma_by_joint_is_said_where_it_is_asked_for(posefield, labelled_path, tmp_path):
    code, out, _ = posefield("pose", labelled_path, *CONTROLS, "--joint-sigma")
    assert code == 0 and len(json.loads(out)["trust"]["joint_sigma"]) == 33
    clip = ["clip", labelled_path, *CONTROLS, "-o", tmp_path / "clip.json", "--json"]
    assert "joint_sigma" not in json.loads(posefield(*clip)[1])
    assert len(json.loads(posefield(*clip, "--joint-sigma")[1])["joint_sigma"]) == 33


# --- suggest --------------------------------------------------------------------------------------


def test_suggest_lists_points_and_answers_as_json(posefield, labelled_path):
    code, out, err = posefield("suggest", labelled_path, "--count", 2)
    assert (code, err, len(out.splitlines())) == (0, "", 3)
    found = json.loads(posefield("suggest", labelled_path, "--performer", "tall", "--json")[1])
    assert (found["performer"], len(found["suggestions"])) == ("tall", 10)


def test_suggest_ranks_what_can_be_captured(posefield, refused, labelled_path, tmp_path):
    table = tmp_path / "can.csv"
    heading = "stature,hip_height,turn,target_height"
    table.write_text(f"{heading}\n1.75,0.9,10,1.0\n1.7,0.7,-20,0.8\n")
    words = ["suggest", labelled_path, "--candidates", table]
    found = json.loads(posefield(*words, "--json")[1])
    assert found["candidates"] == 2
    assert {each["controls"]["turn"] for each in found["suggestions"]} == {10.0, -20.0}
    table.write_text(f"{heading}\n1.75,0.9,10,high\n")
    assert "can.csv:2" in refused(2, *words)


def test_why_of_nothing_is_refused(refused, labelled_path):
    assert "nearest: 0 clips, expected 1" in refused(
        2, "why", labelled_path, *CONTROLS, "--nearest", 0
    )


# --- sample ---------------------------------------------------------------------------------------


def test_sample_writes_any_number_of_clips(posefield, tmp_path, reaching_folder):
    """The seed changes the noise alone; without a number the family has 92 clips."""
    for name, words in {"a": (), "b": ("--seed", 7), "c": ("--seed", 7)}.items():
        own = ("sample", "reaching", "-o", tmp_path / name, "--clips", 8, "--json", *words)
        code, out, _ = posefield(*own)
        assert (code, json.loads(out)) == (0, {"recipe": str(tmp_path / name / "recipe.toml")})
    tables = [(tmp_path / name / "clips.csv").read_text() for name in "abc"]
    controls = [[row.rpartition(",")[0] for row in table.splitlines()] for table in tables]
    assert len(controls[0]) == 9
    assert controls[0] == controls[1]
    clips = [(tmp_path / name / "bvh" / "reach_008.bvh").read_bytes() for name in "abc"]
    assert clips[0] != clips[1] == clips[2]
    assert not {row.split(",", 1)[1] for row in controls[0][1:]} & {
        row.split(",", 1)[1].rpartition(",")[0]
        for row in (reaching_folder / "clips.csv").read_text().splitlines()
    }


def test_the_noise_free_motion_has_no_number_of_clips(refused, tmp_path):
    words = ("reaching", "--truth", "--clips", 5, "-o", tmp_path / "x")
    said = "clips: found with --truth, expected for a family of clips"
    assert refused(2, "sample", *words) == said


def test_sample_of_another_family_is_refused(refused, tmp_path):
    said = refused(2, "sample", "dancing", "-o", tmp_path / "x")
    assert said == "family: 'dancing', expected reaching"


def test_sample_truth_is_the_noise_free_motion(posefield, tmp_path):
    path, fps = tmp_path / "truth.bvh", 30.0
    words = ("sample", "reaching", "--truth", "-o", path, *CONTROLS, "--fps", fps, "--json")
    code, out, _ = posefield(*words)
    assert code == 0
    expected = noise_free.truth_clip(POINT, fps)
    found = bvh.read(path)
    assert (len(found.values), found.rate) == (len(expected), fps)
    # A BVH file of ours is in centimetres.
    clip = bvh.to_clip(found, metres_per_unit=0.01, up="y", root_offset="replace")
    assert np.abs(clip.positions() - expected.positions()).max() < 1e-4
    said = json.loads(out)
    assert (said["model"], said["frames"], said["sigma"]) == ("reaching@truth", len(expected), 0.0)
    assert said["duration"] == pytest.approx(noise_free.duration(POINT), abs=1.0 / fps)


# --- train and inspect ----------------------------------------------------------------------------


@pytest.fixture
def train_words(quick, reaching_folder):
    return ("train", quick, "--data", reaching_folder)


def test_train_writes_a_model_and_says_what_it_measured(posefield, train_words, tmp_path):
    path = tmp_path / "new" / "quick.onnx"
    code, out, err = posefield(*train_words, "-o", path, "--json")
    assert code == 0
    said = json.loads(out)
    assert (said["file"], said["bytes"]) == (str(path), path.stat().st_size)
    assert said["clips"] == 30 and said["tensor"] == [94, 8, 30]
    assert 0.0 < said["parity_m"] < 1e-4
    steps = [line.split(" s  ")[1] for line in err.splitlines()]
    assert steps[0].startswith("reading ") and steps[1].startswith("aligning 30 clips")
    assert steps[-1] == "done"
    assert model_registry.load([path]).models["quick"].session.card.frames == 8
    assert [p.name for p in path.parent.iterdir()] == ["quick.onnx"]


def test_train_finds_its_data_beside_the_recipe(posefield, quick, tmp_path):
    """Omit --data; this recipe stands elsewhere, so its table is not found."""
    said = refused_after_progress(posefield, 3, "train", quick, "-o", tmp_path / "x.onnx")
    assert f"{quick.parent}: no file 'clips.csv'" in said


def refused_after_progress(posefield, code, *words):
    """As refused, for a command that had begun to tell of its progress."""
    found, out, err = posefield(*words)
    assert (found, out) == (code, "")
    progress, _, last = err.rpartition("posefield: ")
    assert all(re.match(r" +[0-9.]+ s  ", line) for line in progress.splitlines())
    return last.strip()


def test_samples_that_make_no_model_are_refused_with_code_4(
    posefield, train_words, quick, tmp_path
):
    text = quick.read_text().replace('column = "turn"', 'column = "stature"')
    still = tmp_path / "still.toml"
    still.write_text(text)
    path = tmp_path / "still.onnx"
    words = ("train", still, *train_words[2:], "-o", path)
    said = refused_after_progress(posefield, 4, *words)
    assert said.startswith("control 'turn' has the value 1.88 in all 30 samples")
    assert not path.exists()


def test_a_recipe_that_is_wrong_is_refused_with_code_3(posefield, quick, tmp_path):
    wrong = tmp_path / "wrong.toml"
    wrong.write_text(quick.read_text().replace("cyclic = false", "cyclic = 0"))
    # Nothing was begun, so that no progress is told.
    code, out, err = posefield("train", wrong, "-o", tmp_path / "x.onnx")
    assert (code, out, err.count("\n")) == (3, "", 1)
    line = 1 + quick.read_text().split("cyclic = false")[0].count("\n")
    assert err.startswith(f"posefield: {wrong}:{line}: motion.cyclic: ")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("-o", "quick.bin"), "output: 'quick.bin', expected a name that ends in .onnx"),
        (("-o", "q.onnx", "--report", "q.pdf"), "report: 'q.pdf', expected a name that ends in"),
    ],
)
def test_a_model_is_an_onnx_file_and_a_report_a_page(
    refused, train_words, tmp_path, monkeypatch, words, said
):
    monkeypatch.chdir(tmp_path)
    assert refused(2, *train_words, *words).startswith(said)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.system
def test_a_report_is_written_and_changes_nothing_in_the_model(posefield, train_words, tmp_path):
    model, quiet, page = tmp_path / "quick.onnx", tmp_path / "quiet.onnx", tmp_path / "a/quick.html"
    code, out, err = posefield(*train_words, "-o", model, "--report", page)
    assert code == 0
    assert re.search(r"quick\.onnx: [0-9.]+ kB from 30 clips, ranks \[\d+, \d+, \d+\]", out)
    assert "onnxruntime differs from the reference by at most 0.0" in out
    facts = json.loads(page.with_suffix(".json").read_text())
    assert [p.name for p in sorted(page.parent.iterdir())] == ["quick.html", "quick.json"]
    steps = [line.split(" s  ")[1] for line in err.splitlines()]
    steps = [step.partition(" (about ")[0] for step in steps]
    assert [step["step"] for step in facts["about"]["steps"]] == steps[:-2]
    assert steps[-2:] == ["drawing the report", "done"]
    assert facts["about"]["bytes"] == model.stat().st_size
    assert page.read_text().startswith("<!DOCTYPE html>")
    assert posefield(*train_words, "-o", quiet)[0] == 0
    assert model.read_bytes() == quiet.read_bytes()


@pytest.mark.system
def test_a_report_that_cannot_be_written_leaves_no_half_of_it(posefield, train_words, tmp_path):
    page = tmp_path / "told" / "quick.html"
    page.mkdir(parents=True)
    words = (*train_words, "-o", tmp_path / "quick.onnx", "--report", page)
    said = refused_after_progress(posefield, 3, *words)
    assert said.startswith(f"{page}: cannot be written: ")
    assert [p.name for p in page.parent.iterdir()] == ["quick.html"]


def test_inspect_answers_as_json(posefield, model_path):
    code, out, _ = posefield("inspect", model_path, "--json")
    assert code == 0
    card = json.loads(out)
    assert card["identity"] == model_registry.load([model_path]).models["reaching"].identity
    assert [c["name"] for c in card["controls"]] == list(POINT)
    assert card["skeleton"]["names"][0] == "Hips"
    assert card["diagnostics"]["notes"] == []
    costs = card["seconds_per_pose"]
    assert len(costs) == len(card["levels"]) and min(costs) > 0.0
    assert costs == sorted(costs, reverse=True)


def test_inspect_tells_people_the_same(posefield, model_path, model_file):
    code, out, _ = posefield("inspect", model_path)
    assert code == 0
    assert "reaching@" in out and "46 clips of 33 joints" in out and "licence: CC0-1.0" in out
    for name in POINT:
        assert re.search(rf"^  {name}: [-0-9.]+ to [0-9.]+ (m|deg), ", out, re.MULTILINE)
    levels = re.findall(r"^  (\d): ranks .*, here [0-9.]+ µs a pose$", out, re.MULTILINE)
    assert levels == ["0", "1", "2", "3"]
    others = {
        "face": "\ncurve jawOpen: 0 to 1, a unit counts as 2 cm\n",
        "measured": " m/s, speed (measured: speed)\n",
        "labelled": "\nperformers: middle, short, tall\n",
    }
    for name, said in others.items():
        assert said in posefield("inspect", model_file(name))[1]
        assert said not in out


def test_what_a_pose_costs_is_not_in_the_file(model_path):
    """It is the machine's, and would make files differ from run to run."""
    assert b"seconds_per_pose" not in model_path.read_bytes()
    assert b"operations" in model_path.read_bytes()


def test_a_corrupt_model_is_refused_with_code_3(refused, model_path, tmp_path):
    path = tmp_path / "half.onnx"
    path.write_bytes(model_path.read_bytes()[:5000])
    for words in (("inspect", path), ("serve", path)):
        assert refused(3, *words).startswith(f"{path}: does not end with its checksum: ")


def test_shipped_models_are_known_by_their_names(posefield, refused, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, out, _ = posefield("pose", "cmu_walk", "-c", "speed=1.2")
    assert code == 0 and json.loads(out)["trust"]["model"].startswith("cmu_walk@")
    assert refused(3, "inspect", "cmu_wlak") == (
        "cmu_wlak: no such file, expected one or a shipped model: "
        f"{', '.join(model_registry.with_shipped([]).models)} (did you mean 'cmu_walk'?)"
    )


# --- pose -----------------------------------------------------------------------------------------


def test_pose_answers_as_json(posefield, model_path):
    code, out, err = posefield("pose", model_path, *CONTROLS, "--time", 0.25, "--time", 0.5)
    assert (code, err) == (0, "")
    said = json.loads(out)
    assert said["times"] == [0.25, 0.5]
    assert np.shape(said["rotations"]) == (2, 33, 4)
    assert np.shape(said["root_position"]) == (2, 3)
    assert np.shape(said["bone_offsets"]) == (33, 3)
    assert said["trust"]["controls"] == POINT and said["trust"]["warnings"] == []
    model = model_registry.load([model_path]).models["reaching"]
    expected = poses.synthesize_poses(model, PoseQuestion(controls=POINT, times=[0.25, 0.5]))
    assert np.abs(said["rotations"] - expected.rotations).max() < 1e-6


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ([*CONTROLS, "-c", "speed=1"], "controls/speed: no such control; this model has stature"),
        ([*CONTROLS[:-1], "target_height"], "control: 'target_height', expected NAME=VALUE"),
        ([*CONTROLS, *CONTROLS[:2]], "control: 'stature=1.7', expected NAME=VALUE, each name once"),
    ],
)
def test_a_question_without_an_answer_is_refused_with_code_2(refused, model_path, words, said):
    assert refused(2, "pose", model_path, *words).startswith(said)


def test_controls_left_out_are_chosen_and_said(posefield, model_path):
    code, out, err = posefield("pose", model_path, *CONTROLS[:-2])
    trust = json.loads(out)["trust"]
    assert (code, trust["inferred"]) == (0, ["target_height"])
    chosen = f"target_height={trust['controls']['target_height']!r}"
    assert err == f"inferred: {chosen}, most typical for what was given\n"
    # What was said is what can be asked for, with the same answer.
    code, again, err = posefield("pose", model_path, *CONTROLS[:-2], "-c", chosen)
    assert (code, err) == (0, "")
    whole, asked = json.loads(out), json.loads(again)
    assert whole["trust"].pop("inferred") and "inferred" not in asked["trust"]
    assert whole == asked


OUTSIDE = [*CONTROLS[:-1], "target_height=2.5"]


def test_outside_the_samples_is_warned_of_or_refused(posefield, refused, model_path):
    code, out, err = posefield("pose", model_path, *OUTSIDE)
    assert code == 0
    assert err.startswith("warning: target_height: asked 2.5 m, given 2.27 m, captured 0.309 to ")
    assert [f"warning: {w}\n" for w in json.loads(out)["trust"]["warnings"]] == [err]
    said = refused(2, "pose", model_path, *OUTSIDE, "--extrapolate", "refuse")
    assert said.startswith("controls: target_height = 2.5 m lies outside")


def test_words_that_the_command_does_not_know_end_with_code_2(posefield, model_path):
    clamped = ("pose", model_path, *CONTROLS, "--extrapolate", "clamp")
    for words in (("pose", model_path, "--speed", "1"), ("dance",), ("clip", model_path), clamped):
        code, out, err = posefield(*words)
        assert (code, out) == (2, "") and "Usage" in err


def test_a_performer_is_asked_for_by_name(posefield, labelled_path, tmp_path):
    asked = [posefield("pose", labelled_path, *CONTROLS, *words)[1] for words in (TALL, ())]
    assert [json.loads(said)["trust"]["performer"] for said in asked] == ["tall", None]
    tall, nobody = (np.array(json.loads(said)["rotations"]) for said in asked)
    # Numbers of JSON are those of float32.
    assert np.abs(tall - nobody).max() > 1e-4
    path = tmp_path / "clip.json"
    code, out, _ = posefield("clip", labelled_path, *CONTROLS, *TALL, "-o", path, "--json")
    assert (code, json.loads(out)["performer"]) == (0, "tall")
    trust, of_pose = json.loads(path.read_text())["trust"], json.loads(asked[0])["trust"]
    # A clip ends on a frame, for which its time is stretched by up to half a frame of 30 a second.
    assert abs(trust.pop("duration") - of_pose.pop("duration")) == pytest.approx(
        trust.pop("stretch"), abs=1e-5
    )
    assert trust == of_pose


# --- clip -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("ending", ["usdz", "bvh", "npz"])
def test_clip_writes_what_the_encoder_of_the_ending_does(posefield, model_path, tmp_path, ending):
    path = tmp_path / "new" / f"clip.{ending}"
    code, out, err = posefield("clip", model_path, *CONTROLS, "-o", path, "--json")
    assert (code, err) == (0, "")
    model = model_registry.load([model_path]).models["reaching"]
    answer = clips.synthesize_clip(
        model, ClipQuestion(controls=POINT, fps=30.0, extrapolate="warn")
    )
    trust = json.loads(json.dumps(answer.trust.document()))
    assert json.loads(out) == {"file": str(path), "frames": len(answer.clip), "rate": 30.0, **trust}
    assert path.read_bytes() == CLIP_ENCODERS[ending].encode(answer)
    assert stat.S_IMODE(path.stat().st_mode) == 0o644
    assert [p.name for p in path.parent.iterdir()] == [path.name]


def test_clip_takes_a_rate_and_a_span(posefield, model_path, tmp_path):
    path = tmp_path / "clip.bvh"
    words = ("--fps", 60, "--start", 0.25, "--end", 0.75)
    code, out, _ = posefield("clip", model_path, *CONTROLS, "-o", path, *words)
    assert code == 0
    assert re.match(rf"{path}: 31 frames at 60 a second, [0-9.]+ s, give or take [0-9.]+ cm", out)
    assert (len(bvh.read(path).values), bvh.read(path).rate) == (31, 60.0)


def test_clip_names_joints_and_measures_as_asked_for(posefield, model_path, tmp_path):
    path = tmp_path / "clip.json"
    words = ("--names", "humanik", "--root", "in_place", "--unit", "cm", "--up", "z")
    assert posefield("clip", model_path, *CONTROLS, "-o", path, *words)[0] == 0
    found = json.loads(path.read_text())
    # What the model calls LowerBack, Spine and Spine1.
    assert found["names"][9:12] == ["Spine", "Spine1", "Spine2"]
    assert (found["units"]["length"], found["units"]["up"]) == ("centimetre", "Z")
    asked = ClipQuestion(controls=POINT, names="humanik", root="in_place")
    answer = clips.synthesize_clip(model_registry.load([model_path]).models["reaching"], asked)
    assert path.read_bytes() == CLIP_ENCODERS["json"].encode(answer, Convention(0.01, "z"))


@pytest.mark.parametrize(
    ("ending", "words", "said"),
    [
        ("glb", ("--unit", "cm"), "unit: 0.01 m, expected 1 m: the law of glb"),
        ("bvh", ("--loop",), "loop: true, expected false: this model's last pose does not lead"),
    ],
)
def test_what_a_clip_cannot_be_is_refused(refused, model_path, tmp_path, ending, words, said):
    path = tmp_path / f"clip.{ending}"
    assert refused(2, "clip", model_path, *CONTROLS, *words, "-o", path).startswith(said)
    assert not path.exists()


FAILING = {
    "a rate of zero": [*CONTROLS, "--fps", "0"],
    "outside the samples": [*OUTSIDE, "--extrapolate", "refuse"],
}


@pytest.mark.parametrize("words", FAILING.values(), ids=FAILING)
def test_a_clip_that_fails_leaves_no_file_and_spoils_none(refused, model_path, tmp_path, words):
    path = tmp_path / "clip.usda"
    refused(2, "clip", model_path, *words, "-o", path)
    assert list(tmp_path.iterdir()) == []
    path.write_text("made before")
    refused(2, "clip", model_path, *words, "-o", path)
    assert path.read_text() == "made before"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("name", ["clip.fbx", "clip.USDA"])
def test_an_unknown_format_is_refused_before_anything_is_read(refused, tmp_path, name):
    said = refused(2, "clip", tmp_path / "none.onnx", "-o", tmp_path / name)
    assert said.startswith(f"output: {name!r} ends in none of usda, usdc")


# --- serve ----------------------------------------------------------------------------------------


def test_serve_refuses_a_port_that_is_none(refused, model_path):
    assert refused(2, "serve", model_path, "--port", "70000").endswith("70000, expected 0 to 65535")
