"""JSON bodies decoded by msgspec, and its complaints as faults that point into the body."""

import re
from typing import TypeVar

import msgspec

from service.web.problems import BAD_BODY, RequestFault, pointer

Body = TypeVar("Body")


def decoded(decoder: msgspec.json.Decoder[Body], content: bytes) -> Body:
    """What the decoder makes of a body; RequestFault where it breaks the decoder's form."""
    try:
        return decoder.decode(content)
    except msgspec.ValidationError as fault:
        raise bad_body(str(fault), pointer(*steps(str(fault)))) from None
    except (msgspec.DecodeError, UnicodeDecodeError) as fault:
        raise bad_body(f"expected UTF-8 JSON; {fault}", "") from None
    except RecursionError:
        raise bad_body("nested too deeply", "") from None


def steps(message: str) -> list[str]:
    """Keys and indices that lead to what a message of msgspec complains of; none for all of it."""
    field = re.search(r"field `(.*?)`(?: - at `|$)", message)
    path = re.search(r"at `\$(.*)`", message)
    found: list[str] = re.findall(r"[^.\[\]]+", path[1]) if path else []
    return found + ([field[1]] if field else [])


def bad_body(detail: str, where: str) -> RequestFault:
    """Refusal of a body for what a JSON pointer leads to; "" is all of it."""
    return RequestFault(BAD_BODY, detail, {"pointer": where})
