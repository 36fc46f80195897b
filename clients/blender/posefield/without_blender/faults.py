"""Why there is no clip.

Fault
├── Offline         Blender may not ask other machines
├── BadAddress      no address of a service
├── Unreachable     nobody listens there
├── TimedOut        too slow
├── CutOff          the answer ended before its end
├── Unintelligible  no posefield, or of another version
├── Refused         the service says why, as RFC 9457 has it
└── Mismatch        the clip has no place on this armature
"""

import json


class Fault(Exception):
    """A question without an answer; the text says what was found and what was expected."""


class Offline(Fault):
    """Blender may not ask other machines."""


class BadAddress(Fault):
    """No address of a service."""


class Unreachable(Fault):
    """Nobody listens there."""


class TimedOut(Fault):
    """The answer takes too long."""


class CutOff(Fault):
    """The answer ended before its end."""


class Unintelligible(Fault):
    """What answered is no posefield, or of another version."""


class Mismatch(Fault):
    """The clip has no place on this armature."""


class Refused(Fault):
    """The service says why not.

    status: of HTTP. kind: what programs tell the problem by, such as `outside-samples`.
    """

    def __init__(self, status: int, kind: str, title: str, detail: str) -> None:
        super().__init__(f"{title} ({status}): {detail}" if detail else f"{title} ({status})")
        self.status = status
        self.kind = kind


def of_problem(status: int, content: bytes) -> Refused:
    """What a service said, or the status alone where it said nothing that can be read."""
    try:
        document = json.loads(content)
        kind = str(document["type"]).rpartition(":")[2].rpartition("/")[2]
        return Refused(status, kind, document["title"], document["detail"])
    except (ValueError, KeyError, TypeError):
        return Refused(status, "", "The service answers no question", "it does not say why")
