"""Tests of archive layouts: content equal to that of folders, and other readers."""

import tarfile
import zipfile
from dataclasses import replace

import exporting
import numpy as np
import pytest
from msgspec import structs
from pxr import Usd, UsdSkel

from posefield.batch import run
from posefield.common.errors import InvalidField
from posefield.registry import model_registry as synthesis
from posefield.synthesis import clips

ROWS, CHUNK = 20, 8


@pytest.fixture(scope="module")
def source():
    return exporting.queries(ROWS, "usdc", fps=10.0)


@pytest.fixture(scope="module")
def made(source, model_path, tmp_path_factory):
    """Folder of an export, by layout."""

    def of(layout):
        folder = tmp_path_factory.mktemp(layout)
        work = exporting.work(model_path, source, folder, CHUNK, layout)
        run.run(work, source, exporting.Recorder())
        return folder

    return {layout: of(layout) for layout in ("folder", "tar", "zip", "library")}


def unpacked(folder, layout):
    """Members of all archives in a folder: name and content, in order."""
    for path in sorted(folder.glob(f"clips-*.{layout}")):
        if layout == "zip":
            with zipfile.ZipFile(path) as archive:
                assert archive.testzip() is None
                yield from ((name, archive.read(name)) for name in archive.namelist())
        else:
            with tarfile.open(path) as archive:
                yield from ((m.name, archive.extractfile(m).read()) for m in archive)


@pytest.mark.parametrize("layout", ["tar", "zip"])
def test_an_archive_for_each_chunk_holds_its_files_and_then_its_manifest(layout, made):
    names = {path.name for path in made[layout].iterdir()}
    archives = {f"clips-{n:06d}.{layout}" for n in range(3)}
    assert names == {*archives, "manifest.jsonl", "export.json"}
    members = list(unpacked(made[layout], layout))
    found = {name: content for name, content in members if not name.startswith("manifest")}
    loose = exporting.content(made["folder"])
    assert found == {path: content for path, content in loose.items() if path.startswith("clips")}
    places = [index for index, (name, _) in enumerate(members) if name.startswith("manifest")]
    assert places == [CHUNK, 2 * CHUNK + 1, ROWS + 2]
    assert [members[place][0] for place in places] == [f"manifest-{n:06d}.jsonl" for n in range(3)]
    assert b"".join(members[place][1] for place in places) == loose["manifest.jsonl"]


def test_a_library_is_one_character_that_can_play_every_clip(made, source, model_path):
    synthesizer = synthesis.load([model_path]).models["reaching"]
    stage = Usd.Stage.Open(str(made["library"] / "character.usd"))
    skeleton = UsdSkel.Skeleton(stage.GetPrimAtPath("/Character/Skel"))
    source_of = UsdSkel.BindingAPI(skeleton).GetAnimationSourceRel()
    for row, query in enumerate(source.rows()):
        clip = clips.synthesize_clip(synthesizer, query.question).clip
        source_of.SetTargets([f"/Character/Clips/{query.name.replace('-', '_')}"])
        cache, root = UsdSkel.Cache(), UsdSkel.Root(stage.GetPrimAtPath("/Character"))
        cache.Populate(root, Usd.PrimDefaultPredicate)
        transforms = cache.GetSkelQuery(skeleton).ComputeJointSkelTransforms(len(clip) - 1)
        found = np.array(transforms)[:, 3, :3]
        # float32 keeps 1e-7 of a coordinate, and errors add up along the chain of joints.
        assert found == pytest.approx(clip.positions()[-1], abs=1e-5)
        # Negative control: its neighbour ends elsewhere.
        other = clips.synthesize_clip(synthesizer, list(source.rows())[row - 1].question).clip
        assert np.abs(found - other.positions()[-1]).max() > 1e-4


def test_what_has_no_place_in_a_library_is_found_before_anything_is_written(
    source, model_path, tmp_path
):
    rows = list(source.rows())
    rows[3] = replace(rows[3], format="bvh")
    rows[5] = replace(rows[5], question=structs.replace(rows[5].question, names="vrm"))
    bad = exporting.Listed(rows)
    work = exporting.work(model_path, bad, tmp_path / "made", layout="library")
    with pytest.raises(InvalidField, match="answered: 2") as refused:
        run.run(work, bad, exporting.Recorder())
    assert "line 5: format: 'bvh', expected 'usdc' in a library" in str(refused.value)
    assert "line 7: names: 'vrm', expected 'own'" in str(refused.value)
    assert not (tmp_path / "made").exists()
    outcome = run.run(replace(work, skip=True), bad, exporting.Recorder())
    assert (outcome.facts["clips"], outcome.facts["skipped"]) == (ROWS - 2, 2)
