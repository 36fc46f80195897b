"""Contact labels of families: quadrupeds, motions in place, tables of clips, and new performers."""

import json
import tomllib

import numpy as np
import pytest
from families import sample_walk
from joblib import parallel_config

from posefield.common.errors import RecipeError
from posefield.inference import session
from posefield.inference.onnx_runtime import CONTACTS
from posefield.motion import bvh_writer
from posefield_train import training
from posefield_train.contacts import contact_labels, contact_model
from posefield_train.contacts.contact_model import FRAMES, SHARES
from posefield_train.evaluate import protocol, summary
from posefield_train.jobs import ProcessJobs
from posefield_train.source import ingest
from posefield_train.source.recipe import Recipe

# Joint that is no foot, whose contacts only a table can give.
RAIL = "Hips"


def walk_recipe(**changes):
    """Recipe of the strides with values of its sections changed or added."""
    plain = tomllib.loads(sample_walk.RECIPE_TEXT)
    for section, values in changes.items():
        plain[section] = {**plain.get(section, {}), **values}
    return Recipe.model_validate(plain)


def labelled(own, examples):
    """Labels (M, K) of each example at the frames of its own time."""
    asked = contact_labels.settings(own, examples[0].clip.skeleton.names)
    return [contact_labels.clip_contacts(example, asked) for example in examples]


def stance(shares, landing):
    """Return which shares are far from both ends of a stance, and in which the foot stands."""
    since = (shares - landing) % 1.0
    sure = (np.abs(since - sample_walk.STANCE) > 0.12) & (since > 0.05) & (since < 0.92)
    return sure, since < sample_walk.STANCE


def test_a_walk_in_place_has_the_contacts_of_the_walk(models_trained, strides):
    own = walk_recipe(motion={"root": "in_place"})
    still, _ = ingest.ingest(own, models_trained.strides_folder())
    order = {example.row.file.name: example for example in still}
    same = [order[example.row.file.name] for example in strides]
    assert max(np.ptp(example.clip.root_path[:, 2]) for example in same) < 0.2
    agree = [
        np.mean(one.contacts == other.contacts)
        for one, other in zip(labelled(own, same), labelled(walk_recipe(), strides), strict=True)
    ]
    assert min(agree) > 0.9
    # Negative control: without the ground's velocity no foot stands.
    asked = contact_labels.settings(walk_recipe(), same[0].clip.skeleton.names)
    assert not contact_labels.clip_contacts(same[0], asked).contacts.all(axis=1).any()


@pytest.fixture
def rail(tmp_path, models_trained):
    """Folder of strides, and its recipe, whose table has contacts of a joint and of a foot."""
    for path in models_trained.strides_folder().iterdir():
        (tmp_path / path.name).write_bytes(path.read_bytes())
    lines = (tmp_path / "strides.csv").read_text().splitlines()
    rows = [f"{lines[0]},rail,left", *(f"{line},10-19,0-5 30-200" for line in lines[1:])]
    (tmp_path / "strides.csv").write_text("\n".join(rows) + "\n")
    return tmp_path, walk_recipe(contacts={"columns": {RAIL: "rail", "LeftFoot": "left"}})


def test_contacts_of_the_table_stand_for_detected_ones(rail):
    folder, own = rail
    examples, _ = ingest.ingest(own, folder)
    for example, clip in zip(examples, labelled(own, examples), strict=True):
        frames = np.linspace(0.0, 1.0, len(clip.contacts))[:-1] * (len(example.clip) - 1)
        left, _, hand = clip.contacts[:-1].T
        assert np.array_equal(hand, (frames >= 9.5) & (frames <= 19.5))
        assert np.array_equal(left, (frames <= 5.5) | (frames >= 29.5))
    trained = training.train_examples(own, examples)
    names = trained.skeleton.names
    found = [names[one.joint] for one in trained.contacts.statistics]
    assert found == ["LeftFoot", "RightFoot", RAIL]
    assert trained.contacts.statistics[2].height == pytest.approx(sample_walk.HIPS, abs=0.1)


@pytest.mark.parametrize("cell", ["20-10", "1-5 4-9", "a-b"])
def test_a_cell_that_is_no_intervals_is_refused(rail, cell):
    folder, own = rail
    table = folder / "strides.csv"
    table.write_text(table.read_text().replace("10-19", cell, 1))
    with pytest.raises(RecipeError, match=r"column 'rail': .* expected intervals of frames") as it:
        ingest.ingest(own, folder)
    assert it.value.line == 2


def newcomers():
    """Strides of a third walker, by their controls."""
    return {
        (3.6 * speed, 1000.0 * turn): sample_walk.walk_stride(speed, turn, 0.07)
        for speed, turn in ((0.8, -0.3), (1.1, 0.3), (1.4, 0.0))
    }


def test_adapting_adds_the_contacts_of_the_new_clips(posefield, walk_path, tmp_path):
    rows = ["file,haste,veer"]
    for index, ((haste, veer), clip) in enumerate(newcomers().items()):
        (tmp_path / f"{index}.bvh").write_bytes(bvh_writer.dumps(clip, metres_per_unit=1.0))
        rows.append(f"{index}.bvh,{haste},{veer}")
    (tmp_path / "cy.csv").write_text("\n".join(rows) + "\n")
    said = ("--performer", "cy", "--unit", "1", "--up", "y", "--licence", "CC0-1.0")
    path = tmp_path / "new.onnx"
    table = tmp_path / "cy.csv"
    code, _, err = posefield("adapt", walk_path, "--table", table, "-o", path, *said)
    assert code == 0, err
    parent, opened = session.load(walk_path), session.load(path)
    assert opened.card.contacts == parent.card.contacts
    assert opened.card.diagnostics["contacts"] == parent.card.diagnostics["contacts"]
    assert not [note for note in opened.card.diagnostics["notes"] if "left out" in note]
    for controls in newcomers():
        point, who = np.array([controls]), np.array([[0.0, 0.0, 1.0]])
        shares = np.linspace(0.0, 1.0, 50)
        times = (
            shares[None] * opened.run(point, None, "duration", labels=who)[0].astype(float)[:, None]
        )
        (found,) = opened.run(point, times, CONTACTS, labels=who)
        for foot, (_, landing) in enumerate(sample_walk.SIDES.values()):
            sure, stands = stance(shares, landing)
            assert np.mean((found[0, sure, foot] > 0.5) == stands[sure]) > 0.97


@pytest.fixture(scope="module")
def clips(strides):
    return strides[3:], strides[:3]


@pytest.fixture(scope="module")
def labels(clips):
    asked = contact_labels.settings(sample_walk.recipe(), clips[1][0].clip.skeleton.names)
    return np.stack([contact_labels.clip_contacts(e, asked).at(SHARES) for e in clips[1]])


def accuracies(clips, predicted):
    asked = sample_walk.recipe(), *clips, (3, 6)
    return contact_model.held_out_accuracies(*asked, lambda _: predicted)


def test_true_contacts_agree_wholly_and_opposite_ones_nowhere(clips, labels):
    right, wrong = accuracies(clips, labels), accuracies(clips, 1.0 - labels)
    assert [(one.agreement, one.brier) for one in right] == [(1.0, 0.0)] * 3
    assert [(one.agreement, one.brier) for one in wrong] == [(0.0, 1.0)] * 3
    half = accuracies(clips, np.full_like(labels, 0.5))
    assert [one.brier for one in half] == [0.25] * 3
    assert all(0.0 < one.climatology < 0.1 for one in right)
    assert contact_model.mean_accuracy(right)["agreement"] == 1.0


def test_an_evaluation_tells_the_contacts_of_clips_held_out(strides):
    plain = sample_walk.recipe().model_dump(by_alias=True, exclude_unset=True)
    own = Recipe.model_validate({**plain, "kriging": {"covariance": "matern52", "drift": 1}})
    with parallel_config(backend="sequential"):
        result = protocol.run_protocol(own, strides[:8], "clip", ProcessJobs(1), lambda *_: None)
    assert len(result.contacts) == 8
    found = json.loads(json.dumps(summary.facts(result)))["contacts"]
    assert found == contact_model.mean_accuracy(result.contacts)
    assert found["agreement"] > 0.95 and FRAMES == 100
    said = summary.trust_text(result)[-1]
    assert said.startswith(f"contacts: {found['agreement']:.1%} of frames agree")
