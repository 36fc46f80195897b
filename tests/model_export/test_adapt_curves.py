"""`posefield adapt` of models with curves, with a skeleton and without."""

import json
from dataclasses import replace

import expressions
import numpy as np
import pytest
from families import face_motion

import posefield_train
from posefield.inference import session
from posefield.question.motion_question import ClipQuestion
from posefield.synthesis import clips
from posefield.synthesis.synthesizer import Synthesizer
from posefield_train.adapt import adaptation, canonical_clips
from posefield_train.align import phase_alignment
from posefield_train.kriging import sample_points

SHOWN = [(0.2, 0.3), (0.5, 0.8), (0.85, 0.4)]
ASKED = {"smile": 0.6, "openness": 0.5}
SAID = ("--performer", "cy", "--unit", "1", "--up", "y", "--licence", "CC0-1.0")
# In the curves' own unit: the own part of a newcomer is 0.25, the truth of known ones 0.02.
NEAR = 0.035


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return expressions.write(tmp_path_factory.mktemp("faces"))


@pytest.fixture(scope="module", params=[False, True], ids=["head", "alone"])
def alone(request):
    return request.param


@pytest.fixture(scope="module")
def trained(folder, alone):
    recipe = expressions.recipe(alone)
    return posefield_train.train(recipe, folder)


@pytest.fixture(scope="module")
def base(trained, alone, tmp_path_factory):
    path = tmp_path_factory.mktemp("base") / "faces.onnx"
    posefield_train.export(trained, path)
    return path


def table_of(folder, alone):
    """The newcomer's table as the model wants it."""
    table = expressions.write_newcomer(folder, SHOWN)
    if alone:
        lines = [line.split(",") for line in table.read_text().splitlines()]
        rows = [["file", *lines[0][2:]], *(line[1:] for line in lines[1:])]
        table.write_text("\n".join(map(",".join, rows)) + "\n")
    return table


@pytest.fixture(scope="module")
def table(alone, tmp_path_factory):
    return table_of(tmp_path_factory.mktemp("cy"), alone)


@pytest.fixture(scope="module")
def rate(alone):
    return ("--rate", f"{expressions.RATE:g}") if alone else ()


@pytest.fixture
def adapted(posefield, base, table, rate, tmp_path):
    path = tmp_path / "new.onnx"
    code, out, err = posefield("adapt", base, "--table", table, "-o", path, *SAID, *rate, "--json")
    assert code == 0, err
    return path, json.loads(out)


def error(path, whose, performer, level=0):
    """Root mean square of the own curves of a performer's answer less the truth of another's."""
    model = Synthesizer("faces", session.load(path))
    question = ClipQuestion(controls=ASKED, performer=performer, level=level, fps=60.0)
    clip = clips.synthesize_clip(model, question).clip
    shares = np.minimum(np.arange(len(clip)) / clip.rate / clip.duration, 1.0)
    true = expressions.values(whose, ASKED["smile"], ASKED["openness"], shares)
    own = [face_motion.CURVE_NAMES.index(name) for name in expressions.OWN]
    return np.sqrt(np.mean(np.square(clip.curve_values[:, own] - true[:, own])))


def test_a_newcomer_has_curves_of_their_own(base, adapted):
    path, _ = adapted
    assert error(path, "cy", "cy") < NEAR
    # Negative controls: the same answer without a name, and of another performer.
    assert error(base, "cy", None) > 2.5 * NEAR
    assert error(path, "cy", "a") > 2.5 * NEAR


def test_curves_of_another_name_are_refused_and_further_ones_noted(
    posefield, base, alone, rate, tmp_path
):
    table = table_of(tmp_path / "cy", alone)
    first = table.parent / "0.curves.csv"
    text = first.read_text()
    lines = text.splitlines()
    more = [f"{lines[0]},tongueOut", *(f"{line},0.5" for line in lines[1:])]
    first.write_text("\n".join(more) + "\n")
    out = tmp_path / "new.onnx"
    words = ("adapt", base, "--table", table, "-o", out, *SAID, *rate)
    assert posefield(*words)[0] == 0
    notes = session.load(out).card.diagnostics["notes"]
    assert any("['tongueOut'], which the model does not have" in note for note in notes)
    first.write_text(text.replace("jawOpen", "jawOpened"))
    code, _, err = posefield(*words)
    assert code != 0 and "no curves ['jawOpen']" in err and "jawOpened" in err
    first.write_text("\n".join(lines[:-1]) + "\n" if not alone else text.replace("0.", "7.", 1))
    code, _, err = posefield(*words)
    assert code != 0 and ("expected as many" in err or "expected 0 to 1" in err)


def test_curves_alone_need_a_rate_and_a_head_needs_a_column(
    posefield, base, alone, table, tmp_path
):
    words = ("adapt", base, "-o", tmp_path / "new.onnx", *SAID, "--table")
    if alone:
        code, _, err = posefield(*words, table)
        assert code != 0 and "expected --rate" in err
        code, _, err = posefield(*words, table, "--rate", "0")
        assert code != 0 and "rate: 0.0, expected frames a second" in err
        return
    plain = table.with_name("plain.csv")
    rows = [line.split(",") for line in table.read_text().splitlines()]
    plain.write_text("\n".join(",".join([row[0], *row[2:]]) for row in rows) + "\n")
    code, _, err = posefield(*words, plain)
    assert code != 0 and "no column 'curves' (the file of the clip's curves)" in err


def test_a_cycle_is_adapted_with_its_curves(models_trained):
    """A stride that begins elsewhere is shifted with its curves, and extends the model's."""
    trained = models_trained.trained("treading")
    known = canonical_clips.adaptable(trained)
    examples = [
        replace(example, row=replace(example.row, performer="cy"))
        for example in models_trained.examples("treading")[2:11:4]
    ]
    later = [phase_alignment.shift_start(example, 0.25) for example in examples]
    for given, in_phase in ((examples, True), (later, True), (later, False)):
        own = replace(known, in_phase=in_phase)
        model = adaptation.adapt(own, given, "cy").model
        labels = sample_points.label_weights([{"performer": "cy"}], model.bank.labels)
        shares = np.linspace(0.0, 0.95, 20)
        controls = np.array([[4.0, 100.0]])
        fields = model.fields(controls, labels, 0)
        times = shares[None] * np.exp(fields["duration"])
        found = model.evaluate(controls, times, labels).curves[0]
        true = models_trained.sole_pressure(shares, 4.0 / 3.6)
        missed = np.sqrt(np.mean(np.square(found - true)))
        assert missed < 0.03 if in_phase else missed > 0.1
