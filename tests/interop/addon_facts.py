"""Expected messages and effects of the add-on while it was driven."""

from typing import Any

OTHER = "something else"


def faults(facts: dict[str, Any]) -> list[str]:
    """Facts that are not as they should be, and those of which anything would do."""
    wrong = [f"{name}: {facts[name]}" for name, right in FACTS.items() if not right(facts[name])]
    return wrong + [f"{name}: not looked at" for name, right in FACTS.items() if right(OTHER)]


def _holds(*words: str) -> Any:
    """Return a check for all words in a text."""
    return lambda said: all(word in str(said) for word in words)


def joined(rows: Any) -> str:
    """Return rows as one text, so that a sentence is whole although it is wrapped."""
    return " ".join(rows) if isinstance(rows, list) else str(rows)


def _is(value: Any) -> Any:
    return lambda found: found == value


FACTS: dict[str, Any] = {
    "installed": _is(["FINISHED"]),
    "an import changes the scene": _is(True),
    "fps": _is([30, 1.0]),
    "actions": _is(["reaching"]),
    "actions after live": _is(["reaching"]),
    "timer runs": _is(True),
    "not live: unchanged": _is(True),
    "undone: as before": _is(True),
    "redone: armatures": _is(1),
    "other axes: armatures": _is(1),
    "other axes: same": _is(True),
    "longer bones said": _holds("bone lengths stay", "cm off", "set aside", "quaternions now"),
    "disturbed": _holds(
        "bones with constraints, which move them away from the clip: 1",
        "beside the clip: 1",
        "tilted by 20 degrees",
    ),
    "uneven scale": _holds("scaled by [1.0, 2.0, 1.0]"),
    "no inheritance": _holds("1 bones", "Inherit Rotation"),
    "being edited": _holds("leave edit mode first"),
    "other names": _holds("it lacks", "it has besides Bone3, Bone4", "33 bones"),
    "other names: unchanged": _is(True),
    "another tree": _holds("elsewhere in the tree", "expected"),
    "no armature": _holds("the active object is none, expected an armature"),
    "no such control": _holds("no control is named speed; there are stature"),
    "no numbers": _holds("expected numbers by name"),
    "no such model": _holds("404", "nobody"),
    "elsewhere": _holds("stay offline"),
    "no address": _holds("'somewhere'", "expected one like http://"),
    "said at 24.0": lambda said: _holds("frames at 24")(said) and not _holds("scene rate")(said),
    "said at 29.97": _holds("scene rate 24 -> 29.97 frames a second"),
    "left rate": _is([24, 250]),
    "stroll range of a loop": _is(0),
    "stroll repeated": _is(True),
    "armature deleted": _holds("import a clip first"),
    "armature deleted: live": _is(False),
    "armature deleted by hand": _holds("import a clip first"),
    "reload: next look": _is(None),
    "reload: thread ended": _is(True),
    "reload: live": _is(False),
    "reload: unchanged": _is(True),
    "reload: stature": _is(1.7),
    "another action": _holds("(Own) is no imported clip"),
    "another action: unchanged": _is(True),
    "drawn before": lambda rows: "Model" in rows and "Import clip" not in rows,
    "drawn after": lambda rows: (
        _holds("'stature (m)'", "A captured clip would lie", "'Captured near here'")(rows)
        and "Outside" not in str(rows)
    ),
    "drawn outside": lambda rows: (
        _holds("Outside: stature is 2.5, sampled: ")(rows)
        and "would lie" not in str(rows)
        and "aptured" not in str(rows)
    ),
    "drawn from far outside": lambda rows: _holds(
        "Outside: stature is 2.5", "A captured clip would lie", "'Nothing like it was captured'"
    )(rows),
    "by hash": _is(""),
    "drawn mixture": lambda rows: (
        _holds("'Performer'", "'ann'", "'Style'", "Moves as a mixture of performers")(rows)
        and "weights" not in str(rows)
    ),
    "drawn open": _holds("0.1 of 1 is left open", "A captured clip would lie"),
    "drawn too much": _holds("The weights' sum is 1.1, expected", "(422): labels/style"),
    "no such label set": _holds("no label set is named mood; there are performer, style"),
    "no such label": _holds("marchng", "did you mean", "marching"),
    "no labels": _holds("expected a name, weights by name or null by label set"),
    "weights above one": _holds("sum of 1.4", "at most 1"),
    "unfit labels: unchanged": _is(True),
    "refresh keeps labels": _is(True),
    "performer of an older file": _is({"performer": "ben"}),
    "drawn take": lambda rows: (
        _holds("Next take", "Variety", "from the prediction", "Feet stand: ")(joined(rows))
        and "Sampled detail" not in rows
    ),
    "drawn until the next take": lambda rows: "Take" in rows and "would lie" not in joined(rows),
    "settings of a script": _is([3, "as_predicted"]),
    "drawn as predicted": lambda rows: _holds("Feet are as predicted: as asked")(joined(rows)),
    "no details": _holds("has no details to sample"),
    "no details: unchanged": _is(True),
    "take of another model": _is([0, "default"]),
    "drawn without feet": lambda rows: (
        _holds("Feet are as predicted: the model names no feet")(joined(rows))
        and "Feet" not in rows
    ),
    "drawn preferences": _holds("plain text", "Without https"),
    "slider": lambda found: found[2] < found[0] < found[1] < found[3],
    "slider words": _holds("stature (m)", "sampled: "),
    "stopped": _holds("no service answers at"),
    "stopped, live": _holds("no service answers at"),
    "stopped: drawn": _holds("no service answers at"),
    "stopped: unchanged": _is(True),
    "stopped, live: unchanged": _is(True),
    "another model, refused": _holds("veer", "1e+09"),
    "another model, no fit": _holds("33 bones, the clip 7 joints"),
    "another model: unchanged": _is(True),
    "another model: taken": _is(["stroll", False]),
    "another model, live": _is([[0, False]]),
    "another model, live: controls": _is(True),
    "unforeseen": _holds("an error in the add-on: AttributeError"),
    "unforeseen: afterwards": _is([]),
    "on: timer": _is(True),
    "on: threads": _is(["posefield"]),
    "on: left": _holds("posefield_controls", "before_load", "after_load"),
    "off: timer": _is(False),
    "off: thread ended": _is(True),
    "off: threads": _is([]),
    "off: left": _is([]),
    "on again": _is(True),
    "script: none": _holds("no text block is picked"),
    "script: not drawn": _is(False),
    "script: drawn": _is(True),
    "script: markers": lambda found: (
        [each[0].split()[:3] for each in found]
        == [["go_on.json:", "0", "walk"], ["go_on.json:", "1", "walk"]]
        and found[0][1] == 1 < found[1][1] <= 61
    ),
    "script: again": _is([1, 1, 2]),
    "script: refused": _holds("go_on.json, line 13: ", "segments/1/tu"),
    "script: line": lambda found: found.startswith('"tu"') or found == "[",
    "script: no JSON": _holds("go_on.json, line 2: no JSON"),
    "script: no text": _holds("no text block is named other; there are go_on.json"),
    "script: unchanged": _is(True),
    "script: no fit": _holds("the clip"),
    "script: onto": _is([1, 2]),
    "script: new": _is(2),
    "a script: named": _is("go_on.json"),
    "a script again: named": _is("go_on.json"),
    "a script onto an armature: named": _is("go_on.json"),
}
