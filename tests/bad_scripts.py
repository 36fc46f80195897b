"""Scripts that are refused: with the pointer and words of their problems.

Models are those of the fixture `models`: walk, a gait, and reach, of another skeleton.
"""

WALK = {"kind": "walk", "model": "walk", "seconds": 2.0}
ROUTE = {"kind": "walk", "model": "walk"}
REACH = {"kind": "act", "model": "reach"}
HOLD = {"kind": "hold", "seconds": 1.0}
FAR = {"joint": "RightHand", "position": [0.0, 9.0, 0.0], "at": "event"}
POSE = {"rotations": [[1.0, 0.0, 0.0, 0.0]] * 7, "root_position": [0.0, 1.0, 0.0]}
HUGE = 1e308


def walk(**fields):
    """A script of one walk of two seconds with these fields."""
    return {"segments": [{**WALK, **fields}]}


def route(**fields):
    """A script of one walk along a path with these fields."""
    return {"segments": [{**ROUTE, **fields}]}


def reach(**fields):
    """A script of one act with these fields."""
    return {"segments": [{**REACH, **fields}]}


def held(**fields):
    """A script of an act and a hold with these fields."""
    return {"segments": [REACH, {**HOLD, **fields}]}


def start(**fields):
    """A script of a walk that begins with these fields."""
    return {"segments": [WALK], "start": fields}


# Scripts that are not of the schema: name, script, pointer and words.
UNREADABLE = {
    "no segments": ({"segments": []}, "/segments", "length >= 1"),
    "257 segments": ({"segments": [WALK] * 257}, "/segments", "length <= 256"),
    "nothing": ({}, "/segments", "missing required field"),
    "segments as text": ({"segments": "walk"}, "/segments", "Expected `array`"),
    "an empty segment": ({"segments": [None]}, "/segments/0", "got `null`"),
    "another kind": (walk(kind="run"), "/segments/0/kind", "expected one of walk, act, hold"),
    "an unknown field": (walk(sped=1), "/segments/0/sped", "did you mean 'speed'?"),
    "two ends": (walk(to=[0.0, 3.0]), "/segments/0", "expected one of them at most"),
    "a turn to a place": (route(to=[0, 3], turn=0.1), "/segments/0", "turn without seconds"),
    "no moment": (
        reach(targets=[{**FAR, "at": "event", "time": 1.0}]),
        "/segments/0/targets/0",
        "time and at, expected one of them",
    ),
    "poses and a place": (start(poses=[POSE], position=[1, 1]), "/start", "one of them"),
    "257 obstacles": (
        {"segments": [WALK], "obstacles": [{"position": [0, 5], "radius": 1}] * 257},
        "/obstacles",
        "length <= 256",
    ),
    "a huge take": ({**walk(), "take": 2**70}, "/take", "Expected `int` <= "),
    "another body": ({"segments": [WALK], "body": "ball"}, "/body", "mannequin"),
}

# Scripts that cannot be performed: name, script, pointer and words.
REFUSED = {
    "two skeletons": ({"segments": [WALK, REACH]}, "/segments/0/model", "7 joints, expected 33"),
    "an act of a gait": (reach(model="walk"), "/segments/0/model", "expected an act"),
    "a walk of a reach": (walk(model="reach"), "/segments/0/model", "does not walk"),
    "too fast": (walk(speed=9), "/segments/0/speed", "9 m/s, expected 0.700 to"),
    "backwards": (walk(speed=-1), "/segments/0/speed", "-1 m/s, expected 0.700 to"),
    "a sharp corner": (
        route(along=[[0, 1], [0, 2], [0.1, 1], [0.2, 2]]),
        "/segments/0/along/1",
        "A wider turn or a lower speed mends it",
    ),
    "a point twice": (route(along=[[0, 1], [0, 3], [0, 3]]), "/segments/0/along/2", "0.1 m or"),
    "no points": (route(along=[]), "/segments/0/along", "expected pairs"),
    "to where it is": (route(to=[0, 0]), "/segments/0/to", "expected 0.1 to 10000 m"),
    "too far": (route(to=[0, 10000]), "/segments/0/speed", "expected"),
    "no end": (route(), "/segments/0", "expected one of them, or an act with a place"),
    "a sharp turn": (walk(turn=9), "/segments/0/turn", "rad/s"),
    "a huge turn": (walk(turn=HUGE), "/segments/0/turn", "expected -1000 to 1000 rad/s"),
    "a huge speed": (walk(speed=[[0, HUGE]]), "/segments/0/speed/0/1", "-1000 to 1000 m/s"),
    "a huge time": (walk(turn=[[HUGE, 0]]), "/segments/0/turn/0/0", "-10000 to 10000"),
    "negative time": (walk(seconds=-1), "/segments/0/seconds", "-1 s, expected 0.1 to 600 s"),
    "no time": (walk(seconds=0), "/segments/0/seconds", "0 s, expected 0.1 to 600 s"),
    "too long": (walk(seconds=601), "/segments/0/seconds", "601 s, expected 0.1 to 600 s"),
    "too long in all": (
        {"segments": [{**WALK, "seconds": 400}] * 2},
        "/segments/1",
        "expected 600 s at most",
    ),
    "a curve out of order": (
        walk(speed=[[0, 1], [2, 1.1], [1, 1]]),
        "/segments/0/speed/2",
        "1 after 2, expected a larger one",
    ),
    "an empty curve": (walk(speed=[]), "/segments/0/speed", "0 pairs, expected 1 to"),
    "a turn out of order": (walk(turn=[[1, 0], [0, 0]]), "/segments/0/turn/1", "0 after 1"),
    "out of reach": (
        {**reach(targets=[FAR]), "extrapolate": "refuse"},
        "/segments/0/targets/0",
        "out of reach",
    ),
    "a huge target": (
        reach(targets=[{**FAR, "position": [0, HUGE, 0]}]),
        "/segments/0/targets/0/position/1",
        "expected -100 to 100 m",
    ),
    "another joint": (
        reach(targets=[{**FAR, "joint": "Hand"}]),
        "/segments/0/targets/0/joint",
        "expected one of Hips",
    ),
    "another control": (reach(controls={"hight": 1}), "/segments/0/controls/hight", "hip_height"),
    "a huge control": (
        reach(controls={"target_height": HUGE}),
        "/segments/0/controls/target_height",
        "expected",
    ),
    "a control of a walk": (walk(controls={"hight": 1}), "/segments/0/controls/hight", "haste"),
    "another performer": (reach(performer="x"), "/segments/0/performer", "middle, short, tall"),
    "another label": (walk(labels={"mood": "sad"}), "/segments/0/labels/mood", "label sets"),
    "facing alone": (reach(facing=1), "/segments/0/facing", "expected with at only"),
    "facing huge": (reach(at=[0, 0], facing=HUGE), "/segments/0/facing", "-1000 to 1000 rad"),
    "a huge place": (reach(at=[HUGE, 0]), "/segments/0/at/0", "-10000 to 10000 m"),
    "a huge point": (route(to=[0, HUGE]), "/segments/0/to/1", "-10000 to 10000 m"),
    "a huge path": (route(along=[[0, HUGE]]), "/segments/0/along/0/1", "-10000 to 10000 m"),
    "a huge start": (start(position=[HUGE, 0]), "/start/position/0", "-10000 to 10000 m"),
    "a huge heading": (start(heading=HUGE), "/start/heading", "-1000 to 1000 rad"),
    "a huge look": (held(look_at=[HUGE, 0, 0]), "/segments/1/look_at/0", "-10000 to 10000 m"),
    "a hold first": ({"segments": [HOLD]}, "/segments/0", "expected a walk or an act before"),
    "a held trunk": (held(joint="Spine"), "/segments/1/joint", "an arm or a leg leads to"),
    "a held nothing": (held(joint="Spin"), "/segments/1/joint", "did you mean 'Spine'?"),
    "a hold of no time": (held(seconds=1e-9), "/segments/1/seconds", "expected 0.1 to 600"),
    "other poses": (
        start(poses=[{**POSE, "rotations": [[1, 0, 0, 0]] * 3}] * 2),
        "/start/poses/0/rotations",
        "3 rotations, expected 7",
    ),
    "poses not unit": (
        start(poses=[POSE, {**POSE, "rotations": [[1, 1, 0, 0]] * 7}]),
        "/start/poses/1/rotations",
        "expected unit quaternions",
    ),
    "poses far away": (
        start(poses=[{**POSE, "root_position": [1e9, 1, 0]}] * 2),
        "/start/poses",
        "beyond 100 km",
    ),
    "an obstacle": (
        {**route(along=[[0, 10]]), "obstacles": [{"position": [0, 5], "radius": 1}]},
        "/obstacles/0",
        "expected 1.00 m or more",
    ),
    "a hollow obstacle": (
        {**walk(), "obstacles": [{"position": [0, 5], "radius": -1}]},
        "/obstacles/0/radius",
        "expected more than 0",
    ),
    "a huge obstacle": (
        {**walk(), "obstacles": [{"position": [0, 5], "radius": HUGE}]},
        "/obstacles/0/radius",
        "expected -1000 to 1000 m",
    ),
    "no frames": ({**walk(), "fps": 0}, "/fps", "0 frames/s, expected 1 to 240 frames/s"),
    "too many frames": (
        {**walk(), "fps": 1e9},
        "/fps",
        "1e+09 frames/s, expected 1 to 240 frames/s",
    ),
    "a negative join": (
        {"segments": [WALK, {**WALK, "join": {"seconds": -1}}]},
        "/segments/1/join/seconds",
        "expected more than 0 s",
    ),
    "poses too far apart": (
        {"segments": [WALK, HOLD, {**WALK, "join": {"most": 1e-5}}]},
        "/segments/2/join/most",
        "m apart at the cut, expected 1e-05 m at most",
    ),
    "a negative take": ({**walk(), "take": -1}, "/take", "-1, expected 0 to 999999999"),
    "much variety": ({**walk(), "variety": 99}, "/variety", "99, expected 0 to 1"),
    "another level": ({**walk(), "level": 99}, "/level", "99, expected 0 to"),
    "a negative level": ({**walk(), "level": -1}, "/level", "-1, expected 0 to"),
    "names without roles": ({**walk(), "names": "vrm"}, "/names", "expected 'own'"),
    "another character": (
        {**walk(), "character": {"model": "reach"}},
        "/segments/0/model",
        "7 joints, expected 33",
    ),
    "another performer's bones": (
        {**walk(), "character": {"model": "walk", "performer": "x"}},
        "/character/performer",
        "ann, ben",
    ),
}

# Scripts with a model that there is not.
ABSENT = {
    "no such model": ({"segments": [WALK, {**WALK, "model": "walc"}]}, "/segments/1/model"),
    "no such character": ({**walk(), "character": {"model": "x"}}, "/character/model"),
}
