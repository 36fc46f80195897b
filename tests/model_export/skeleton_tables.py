"""Reader of the tables of skeletons in `roles/`, with the expected role of each joint."""

import re
from dataclasses import dataclass
from pathlib import Path

FOLDER = Path(__file__).parent / "roles"
CHOICE = re.compile(r"\{([^,}]*),([^}]*)\}")


@dataclass(frozen=True)
class NamedSkeleton:
    """A skeleton of a naming convention. expected: role by joint, "?" for one not scored."""

    convention: str
    names: tuple[str, ...]
    parents: tuple[int, ...]
    expected: dict[str, str]

    def count(self, found):
        """Numbers of right, wrong and missing roles. found: joint by role."""
        wanted = {role: joint for joint, role in self.expected.items() if role != "?"}
        open_ = {joint for joint, role in self.expected.items() if role == "?"}
        right = sum(found.get(role) == joint for role, joint in wanted.items())
        wrong = [
            (role, joint)
            for role, joint in found.items()
            if wanted.get(role) != joint and joint not in open_
        ]
        missing = [role for role in wanted if role not in found]
        return right, wrong, missing


def read(name):
    """Return the skeletons of a table by convention."""
    parts = re.split(r"(?m)^\[(.+)\]$", (FOLDER / f"{name}.txt").read_text())
    return {
        title: skeleton(title, text) for title, text in zip(parts[1::2], parts[2::2], strict=True)
    }


def skeleton(title, text):
    """Return the skeleton of an indented text."""
    lines = [line for line in text.splitlines() if line.strip()]
    names, parents, expected = [], [], {}
    open_joints = {}
    for level, line in expanded(lines):
        name, _, role = line.partition(" = ")
        parents.append(open_joints[level - 1] if level else -1)
        open_joints[level] = len(names)
        names.append(name)
        if role:
            expected[name] = role
    return NamedSkeleton(title, tuple(names), tuple(parents), expected)


def level_of(line):
    return (len(line) - len(line.lstrip())) // 2


def expanded(lines):
    """Yield level and text of each joint; subtrees with two sides come twice."""
    index = 0
    while index < len(lines):
        end = index + 1
        if not CHOICE.search(lines[index]):
            yield level_of(lines[index]), lines[index].strip()
        else:
            while end < len(lines) and level_of(lines[end]) > level_of(lines[index]):
                end += 1
            for side in (0, 1):
                for line in lines[index:end]:
                    yield level_of(line), one_side(line.strip(), side)
        index = end


def one_side(line, side):
    first = CHOICE.search(line)
    word = first[1 + side]
    said = "left" if word.lower().startswith("l") else "right"
    return CHOICE.sub(lambda found: found[1 + side], line).replace("~", said)
