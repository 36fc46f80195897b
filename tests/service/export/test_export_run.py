"""Tests of export runs: equal bytes for all ways to run, and their reports."""

import hashlib
import shutil

import exporting
import pytest

from posefield.batch import process_pool, run
from posefield.batch.rows import Row
from posefield.batch.run import Shard
from posefield.common.errors import FileError, InvalidField
from posefield.encode.formats import CLIP_ENCODERS
from posefield.registry import model_registry
from posefield.synthesis import clips

ROWS = 30


@pytest.fixture(scope="module")
def source():
    return exporting.queries(ROWS)


@pytest.fixture(scope="module")
def undisturbed(source, model_path, tmp_path_factory):
    """Folder of a whole export, done in one go."""
    target = tmp_path_factory.mktemp("undisturbed") / "made" / "here"
    watch = exporting.Recorder()
    outcome = run.run(exporting.work(model_path, source, target), source, watch)
    assert (outcome.rows, outcome.done, outcome.already_complete) == (ROWS, ROWS, False)
    assert watch.begun == (ROWS, 0)
    assert [part.clips for part in watch.parts] == [8, 8, 8, 6]
    return target


def test_every_query_has_the_file_of_its_encoder_and_a_true_line(undisturbed, source, model_path):
    synthesizer = model_registry.load([model_path]).models["reaching"]
    lines = exporting.lines(undisturbed / "manifest.jsonl")
    for line, query in zip(lines, source.rows(), strict=True):
        answer = clips.synthesize_clip(synthesizer, query.question)
        expected = CLIP_ENCODERS["json"].encode(answer)
        assert (undisturbed / f"clips/000/{query.name}.json").read_bytes() == expected
        assert (line["name"], line["file"]) == (query.name, f"clips/000/{query.name}.json")
        assert line["bytes"] == len(expected)
        assert line["sha256"] == hashlib.sha256(expected).hexdigest()
        assert line["controls"] == query.question.controls
        assert line["sigma"] == pytest.approx(answer.trust.sigma)
    assert len(list((undisturbed / "clips/000").iterdir())) == ROWS


@pytest.mark.system
@pytest.mark.parametrize("workers", [2, 3])
def test_processes_make_the_same_bytes(workers, undisturbed, source, model_path, tmp_path):
    work = exporting.work(model_path, source, tmp_path)
    outcome = run.run(work, source, exporting.Recorder(), process_pool.runner(workers))
    assert outcome.done == ROWS
    assert exporting.content(tmp_path) == exporting.content(undisturbed)


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 0, 1)])
def test_shards_in_any_order_make_the_whole(order, undisturbed, source, model_path, tmp_path):
    work = exporting.work(model_path, source, tmp_path)
    outcomes = [
        run.run(work, source, exporting.Recorder(), shard=Shard(index, 3)) for index in order
    ]
    assert [outcome.facts is None for outcome in outcomes] == [True, True, False]
    assert exporting.content(tmp_path) == exporting.content(undisturbed)


@pytest.mark.parametrize("lost", ["manifest.jsonl", "a clip"])
def test_what_was_complete_and_lost_a_file_is_made_again(
    lost, undisturbed, source, model_path, tmp_path
):
    target = shutil.copytree(undisturbed, tmp_path / "target")
    clip = next(target.glob("clips/*/*"))
    (clip if lost == "a clip" else target / lost).unlink()
    work = exporting.work(model_path, source, target)
    outcome = run.run(work, source, exporting.Recorder())
    assert (outcome.already_complete, outcome.done) == (False, ROWS)
    assert exporting.content(target) == exporting.content(undisturbed)


@pytest.mark.parametrize("stop", [1, 3])
def test_what_was_stopped_goes_on(stop, undisturbed, source, model_path, tmp_path):
    work = exporting.work(model_path, source, tmp_path)
    outcome = run.run(work, source, exporting.Recorder(stop))
    assert (outcome.done, outcome.facts) == (8 * stop, None)
    watch = exporting.Recorder()
    assert run.run(work, source, watch).facts is not None
    assert watch.begun == (ROWS, 8 * stop)
    assert exporting.content(tmp_path) == exporting.content(undisturbed)


@pytest.mark.parametrize("harm", [lambda path: path.unlink(), lambda path: path.write_bytes(b"")])
def test_a_chunk_whose_files_have_gone_is_done_again(
    harm, undisturbed, source, model_path, tmp_path
):
    work = exporting.work(model_path, source, tmp_path)
    run.run(work, source, exporting.Recorder(2))
    harm(tmp_path / "clips/000/clip-0003.json")
    watch = exporting.Recorder()
    run.run(work, source, watch)
    assert watch.begun == (ROWS, 8)
    assert exporting.content(tmp_path) == exporting.content(undisturbed)


def test_another_export_is_refused_and_left(source, model_path, tmp_path):
    run.run(exporting.work(model_path, source, tmp_path), source, exporting.Recorder(1))
    before, others = exporting.content(tmp_path), exporting.queries(ROWS - 1)
    with pytest.raises(FileError, match="holds another export, whose queries differ"):
        run.run(exporting.work(model_path, others, tmp_path), others, exporting.Recorder())
    with pytest.raises(FileError, match="holds another export, whose chunk differ"):
        run.run(exporting.work(model_path, source, tmp_path, 9), source, exporting.Recorder())
    assert exporting.content(tmp_path) == before


@pytest.mark.parametrize("name", ["mine.txt", "export.json"])
def test_a_folder_of_something_else_is_refused_and_left(name, source, model_path, tmp_path):
    (tmp_path / name).write_text("{}")
    with pytest.raises(FileError, match=r"has no manifest|facts cannot be read"):
        run.run(exporting.work(model_path, source, tmp_path), source, exporting.Recorder())
    assert exporting.content(tmp_path) == {name: b"{}"}


def test_a_fault_found_late_ends_it_and_skipping_goes_on(source, model_path, tmp_path):
    rows = list(source.rows())
    rows[10] = Row("late", "json", exporting.question(end=50.0), "line 13")
    bad = exporting.Listed(rows)
    work = exporting.work(model_path, bad, tmp_path)
    for by in (process_pool.run_here, process_pool.runner(2)):
        with pytest.raises(
            InvalidField, match=r"rows that cannot be answered: 1 .*\n  line 13: end: 50"
        ):
            run.run(work, bad, exporting.Recorder(), by)
        assert not (tmp_path / "manifest.jsonl").exists()
    watch = exporting.Recorder()
    outcome = run.run(exporting.work(model_path, bad, tmp_path, skip=True), bad, watch)
    assert watch.begun[1] >= 8
    assert (outcome.facts["clips"], outcome.facts["skipped"]) == (ROWS - 1, 1)
