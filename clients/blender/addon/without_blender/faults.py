"""Errors of requests and imports.

Fault
├── Offline         Blender's online access is off
├── BadAddress      invalid address of a service
├── Unreachable     no service responds at the address
├── TimedOut        the timeout was exceeded
├── CutOff          the response is incomplete
├── Unintelligible  not a posefield service, or of another version
├── Refused         problem document of the service (RFC 9457)
├── InScript        error in the script of a performance, with its line
└── Mismatch        the clip does not fit the armature
"""

import json


class Fault(Exception):
    """Base of all errors of the add-on; the text names the found and the expected value."""


class Offline(Fault):
    """Blender's online access is off, and the service is on another machine."""


class BadAddress(Fault):
    """The address is not that of a service."""


class Unreachable(Fault):
    """No service responds at the address."""


class TimedOut(Fault):
    """The response exceeded the timeout."""


class CutOff(Fault):
    """The response is incomplete."""


class Unintelligible(Fault):
    """The response is not from a posefield service, or from one of another version."""


class Mismatch(Fault):
    """The clip does not fit the armature."""


class Refused(Fault):
    """The service refused the request.

    status: of HTTP. kind: type of the problem, such as `outside-samples`. pointer: JSON pointer to
    the cause in the body; None if it is not stated.
    """

    pointer: str | None = None

    def __init__(self, status: int, kind: str, title: str, detail: str) -> None:
        super().__init__(f"{title} ({status}): {detail}" if detail else f"{title} ({status})")
        self.status = status
        self.kind = kind


class InScript(Fault):
    """The script of a performance cannot be performed.

    pointer: JSON pointer to the cause. line: its line in the text, from 1.
    """

    def __init__(self, words: str, pointer: str, line: int) -> None:
        super().__init__(f"line {line}: {words}")
        self.pointer = pointer
        self.line = line


def of_problem(status: int, content: bytes) -> Refused:
    """Return the error of a problem document, or of the status alone if the document is invalid."""
    try:
        document = json.loads(content)
        kind = str(document["type"]).rpartition(":")[2].rpartition("/")[2]
        found = Refused(status, kind, document["title"], document["detail"])
        pointers = [each.get("pointer") for each in document.get("errors", [])]
        found.pointer = next((each for each in pointers if isinstance(each, str)), None)
        return found
    except (ValueError, KeyError, TypeError, AttributeError):
        return Refused(status, "", "The service answers no question", "it does not say why")
