"""Tests of scripts of performances in the add-on: their lines, results and errors."""

import io
import json

import numpy as np
import pytest
from without_blender import cards, faults, scripts
from without_blender.service import Service

TEXT = """{
  "segments": [
    {"kind": "walk", "model": "walk", "seconds": 2},
    {
      "kind": "walk", "model": "walk", "to": [0, 6],
      "join": {"cut": "best"}
    }
  ],
  "a/b": {"~": 1}
}
"""


@pytest.mark.parametrize(
    ("pointer", "line"),
    [
        ("", 1),
        ("/segments", 2),
        ("/segments/0", 3),
        ("/segments/0/seconds", 3),
        ("/segments/1", 4),
        ("/segments/1/to/1", 5),
        ("/segments/1/join/cut", 6),
        ("/a~1b/~0", 9),
        # The innermost part that is there.
        ("/segments/1/speed", 4),
        ("/segments/7", 2),
        ("/segments/0/model/0", 3),
        ("/none", 1),
    ],
)
def test_a_pointer_has_a_line(pointer, line):
    assert scripts.line_of(TEXT, pointer) == line
    assert scripts.line_of("\n" + TEXT.replace("\n", "\r\n"), pointer) == line + 1
    assert scripts.line_of(json.dumps(json.loads(TEXT)), pointer) == 1


def test_a_script_is_performed(address):
    asked = Service(address)
    clip = scripts.ask(asked, TEXT.replace(',\n  "a/b": {"~": 1}', ""), 24.0)
    assert clip.rate == 24.0
    assert clip.path[-1, 1] < -5.0, "forward is -Y in Blender"
    assert clip.parents == cards.get(asked, scripts.character(clip)).parents
    found = scripts.moments(clip)
    assert [each.words.partition(" (")[0] for each in found] == ["0 walk walk", "1 walk walk"]
    assert found[0].time == 0.0 < found[1].time < 2.5
    assert "join, " not in found[1].words, "a walk of the same walker goes on without a join"
    script = json.loads(TEXT)
    del script["a/b"]
    script["segments"].insert(1, {"kind": "hold", "seconds": 0.5})
    held = scripts.moments(scripts.ask(asked, json.dumps(script), 24.0))
    assert "join, " in held[2].words


def test_a_script_has_its_own_frame_rate(address):
    text = '{"fps": 60, "segments": [{"kind": "walk", "model": "walk", "seconds": 1}]}'
    clip = scripts.ask(Service(address), text, 24.0)
    assert (clip.rate, len(clip)) == (60.0, 61)


@pytest.mark.parametrize(
    ("old", "new", "line", "words"),
    [
        ('"to": [0, 6]', '"tu": [0, 6]', 5, "tu"),
        ('"seconds": 2', '"seconds": -2', 3, "-2"),
        ('"model": "walk", "to"', '"model": "wlk", "to"', 5, "wlk"),
        ('"best"', '"worst"', 6, "worst"),
        (',\n  "a/b"', ',\n  "obstacels"', 9, "obstacels"),
    ],
)
def test_a_refusal_names_the_line(address, old, new, line, words):
    text = TEXT.replace(',\n  "a/b": {"~": 1}', "") if "a/b" not in old else TEXT
    assert old in text
    with pytest.raises(faults.InScript, match=rf"^line \d+: .*{words}") as caught:
        scripts.ask(Service(address), text.replace(old, new), 30.0)
    assert caught.value.line == line


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ('{\n"segments": [,]}', 2, "no JSON"),
        ("", 1, "no JSON"),
        ("[]", 1, "no JSON object"),
        ('{\n"fps": NaN}', 1, "NaN, expected a finite number"),
        ('{"segments": [],\n "unit": "cm"}', 2, "unit is 'cm', expected none"),
        ('{"segments": [],\n\n "up": "z"}', 3, "up is 'z', expected none"),
        ("[" * 100_000, 1, "no JSON"),
    ],
)
def test_a_text_that_is_no_script_is_refused_before_it_is_sent(text, line, words):
    with pytest.raises(faults.InScript, match=words) as caught:
        scripts.ask(Service("http://127.0.0.1:1"), text, 30.0)
    assert caught.value.line == line


def report(**other):
    """Trust of a performance of one act, as the service tells it."""
    own = {"kind": "act", "model": "grab@01", "begins": 0.0, "event": 0.5}
    hold = {"kind": "hold", "model": "grab@01", "begins": 0.5}
    walk = {"kind": "walk", "model": "walk@02", "begins": 1.5}
    join = {"segment": 2, "distance": 0.31, "hard": True}
    warning = {"pointer": "/segments/1/to", "message": "turns"}
    found = {"character": "grab@01", "sigma": 0.1, "segments": [own, hold, walk]}
    return found | {"joins": [join], "warnings": [warning]} | other


def performance(trust):
    clip = {"names": np.array(["Hips"]), "parents": np.array([-1]), "rate": np.array(30.0)}
    arrays = {"rotations": np.array([[[1.0, 0, 0, 0]]]), "root_position": np.zeros((1, 3))}
    units = {"units": np.array(json.dumps({"length": "metre", "up": "Y"}))}
    return clip | arrays | units | {"bone_offsets": np.zeros((1, 3))} | {"trust": trust}


def packed(trust):
    stream = io.BytesIO()
    np.savez(stream, **performance(np.array(json.dumps(trust))))
    return stream.getvalue()


def test_segments_joins_and_events_are_moments():
    found = [(each.time, each.words) for each in scripts.moments(scripts.decode(packed(report())))]
    assert found == [
        (0.0, "0 act grab"),
        (0.5, "0 event"),
        (0.5, "1 hold"),
        (1.5, "2 walk walk (hard join, 31 cm)"),
    ]


def test_warnings_have_the_line_of_the_script():
    clip = scripts.decode(packed(report()))
    assert scripts.sentences(clip, TEXT) == ["line 5, /segments/1/to: turns"]


@pytest.mark.parametrize(
    "other",
    [
        {"segments": []},
        {"segments": [{"kind": "walk"}]},
        {"segments": [{"kind": "walk", "model": "a@0", "begins": float("nan")}]},
        {"joins": [{"segment": 1}]},
        {"warnings": [{"pointer": None, "message": "a"}]},
        {"character": None},
        {"sigma": float("inf")},
        {"joins": None},
    ],
)
def test_a_report_that_cannot_be_shown_is_refused(other):
    with pytest.raises(faults.Unintelligible, match="cannot be read"):
        scripts.decode(packed(report(**other)))
