"""Reading a request's body without trusting its length."""

from starlette.requests import Request

from service.web.problems import BODY_TOO_LARGE, NOT_JSON, RequestFault

MEDIA_TYPE = "application/json"


async def read(request: Request, limit: int) -> bytes:
    """Body of a JSON request; nothing beyond `limit` bytes is read, declared or chunked."""
    _check_media_type(request.headers.get("content-type", ""))
    return await content(request, limit)


async def content(request: Request, limit: int) -> bytes:
    """Body of a request, whatever it is; nothing beyond `limit` bytes is read."""
    if _declared(request) > limit:
        raise _too_large(limit)
    found = bytearray()
    async for chunk in request.stream():
        found += chunk
        if len(found) > limit:
            raise _too_large(limit)
    return bytes(found)


def _check_media_type(given: str) -> None:
    name, _, parameters = given.partition(";")
    charset = parameters.strip().lower()
    if name.strip().lower() != MEDIA_TYPE or charset not in ("", "charset=utf-8"):
        raise RequestFault(NOT_JSON, f"Content-Type {given!r}, expected {MEDIA_TYPE!r}")


def _declared(request: Request) -> int:
    length = request.headers.get("content-length", "")
    return int(length) if length.isascii() and length.isdigit() else 0


def _too_large(limit: int) -> RequestFault:
    # The rest of the body is still on its way: only a closed connection stops it.
    detail = f"more than {limit} bytes, expected at most {limit}"
    return RequestFault(BODY_TOO_LARGE, detail, headers={"Connection": "close"})
