"""Parser of the HIERARCHY section.

It does not recurse, so that deep nesting cannot overflow the stack.
"""

import re
from dataclasses import dataclass, field

from posefield_train.source.bvh.bvh_content import CHANNELS, BvhJoint, Vector, quote
from posefield_train.source.bvh.bvh_tokens import TokenCursor

MAX_JOINTS = 1000
MAX_DEPTH = 256
"""Limits of joints and levels, several times those of any character."""

CHANNEL_NAMES = {name.lower(): name for name in CHANNELS}
COUNT = re.compile(r"\d{1,3}", re.ASCII)


@dataclass
class JointDraft:
    """A joint before its closing brace."""

    name: str
    parent: int
    line: int
    offset: Vector | None = None
    channels: tuple[str, ...] | None = None
    has_children: bool = False


@dataclass
class HierarchyReader:
    """Joints and end sites read so far. open: indices of the joints around the cursor."""

    tokens: TokenCursor
    drafts: list[JointDraft] = field(default_factory=list)
    tips: list[tuple[int, Vector]] = field(default_factory=list)
    open: list[int] = field(default_factory=list)
    lines: dict[str, int] = field(default_factory=dict)

    def read(self) -> None:
        """Read one whole tree."""
        self.tokens.expect("HIERARCHY")
        self.tokens.expect("ROOT")
        self.begin_joint()
        while self.open:
            self.statement()
        self.finish()

    def statement(self) -> None:
        """Read one statement inside the innermost open joint."""
        match (word := self.tokens.take()).upper():
            case "OFFSET":
                self.offset()
            case "CHANNELS":
                self.channels()
            case "JOINT":
                self.begin_joint()
            case "END":
                self.end_site()
            case "}":
                self.end_joint()
            case _:
                joint = self.drafts[self.open[-1]]
                raise self.tokens.unexpected(
                    word,
                    "OFFSET, CHANNELS, JOINT, End Site or '}' in joint "
                    f"{quote(joint.name)} of line {joint.line}",
                )

    def begin_joint(self) -> None:
        """Read a joint's name and its opening brace."""
        draft = JointDraft(
            self.tokens.take_name(), self.open[-1] if self.open else -1, self.tokens.line
        )
        if first := self.lines.get(draft.name):
            raise self.tokens.error(
                f"joint name {quote(draft.name)} stands at line {first} and again at line "
                f"{draft.line}, expected every joint to have its own name"
            )
        self.lines[draft.name] = draft.line
        self.begin_child()
        self.open.append(len(self.drafts))
        self.drafts.append(draft)
        self.refuse_excess()
        self.tokens.expect("{")

    def begin_child(self) -> None:
        """Mark the innermost open joint as having children.

        Its OFFSET and CHANNELS must precede them.
        """
        if self.open:
            self.drafts[self.open[-1]].has_children = True

    def refuse_excess(self) -> None:
        """Raise BvhError for too many joints or levels."""
        if len(self.drafts) > MAX_JOINTS:
            raise self.tokens.error(
                f"found {len(self.drafts)} joints, expected at most {MAX_JOINTS}"
            )
        if len(self.open) > MAX_DEPTH:
            raise self.tokens.error(f"found {len(self.open)} levels, expected at most {MAX_DEPTH}")

    def offset(self) -> None:
        """Read the OFFSET of the innermost open joint."""
        draft = self.drafts[self.open[-1]]
        self.refuse_misplaced("OFFSET", draft.offset is not None)
        draft.offset = self.tokens.take_offset()

    def channels(self) -> None:
        """Read the CHANNELS of the innermost open joint."""
        draft = self.drafts[self.open[-1]]
        self.refuse_misplaced("CHANNELS", draft.channels is not None)
        draft.channels = self.channel_names()

    def refuse_misplaced(self, keyword: str, repeated: bool) -> None:
        """Raise BvhError for a second OFFSET or CHANNELS, and for one after a child.

        After a child, the order of the columns would be ambiguous.
        """
        name = quote(self.drafts[self.open[-1]].name)
        if repeated:
            raise self.tokens.error(f"found a second {keyword} in joint {name}, expected one")
        if self.drafts[self.open[-1]].has_children:
            raise self.tokens.error(
                f"found {keyword} of joint {name} after a child, expected it before"
            )

    def channel_names(self) -> tuple[str, ...]:
        """Read the declared count of channels and as many different names."""
        word = self.tokens.take()
        if not COUNT.fullmatch(word):
            raise self.tokens.unexpected(word, "the number of CHANNELS")
        line, declared, names = self.tokens.line, int(word), list[str]()
        while self.tokens.peek().lower() in CHANNEL_NAMES:
            name = CHANNEL_NAMES[self.tokens.take().lower()]
            if name in names:
                raise self.tokens.error(
                    f"found channel {name} a second time in one joint, expected once"
                )
            names.append(name)
        if len(names) < declared and self.is_misspelled(self.tokens.peek()):
            raise self.tokens.unexpected(
                self.tokens.take(), f"a channel, one of {', '.join(CHANNELS)}"
            )
        if len(names) != declared:
            self.tokens.line = line
            raise self.tokens.error(
                f"found {len(names)} channel names, expected CHANNELS {declared}"
            )
        return tuple(names)

    @staticmethod
    def is_misspelled(word: str) -> bool:
        """Return True if a word among the channel names is not a keyword that can follow them."""
        return word.upper() not in ("", "{", "}", "OFFSET", "CHANNELS", "JOINT", "END")

    def end_site(self) -> None:
        """Read an End Site; a joint may have several."""
        self.tokens.expect("Site")
        self.begin_child()
        self.tokens.expect("{")
        self.tokens.expect("OFFSET")
        self.tips.append((self.open[-1], self.tokens.take_offset()))
        self.tokens.expect("}")

    def end_joint(self) -> None:
        """Close the innermost open joint."""
        draft = self.drafts[self.open.pop()]
        if draft.offset is None:
            raise self.tokens.error(
                f"found the end of joint {quote(draft.name)} of line {draft.line}, "
                "expected its OFFSET first"
            )

    def finish(self) -> None:
        """Raise BvhError for anything but MOTION after the tree."""
        word = self.tokens.take()
        if word.upper() == "ROOT":
            raise self.tokens.error(f"one root expected, found a second at line {self.tokens.line}")
        if word or self.tokens.end != "MOTION":
            raise self.tokens.unexpected(word, "a line MOTION after the root's closing brace")

    def joints(self) -> tuple[BvhJoint, ...]:
        """Return the joints, after all are closed."""
        return tuple(
            BvhJoint(
                draft.name, draft.parent, draft.offset or (0.0, 0.0, 0.0), draft.channels or ()
            )
            for draft in self.drafts
        )
