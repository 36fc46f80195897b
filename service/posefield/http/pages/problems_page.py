"""The page at `/problems`, target of the Link header of each problem."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field

from posefield.common.errors import (
    InvalidField,
    OutOfReach,
    OutsideSamples,
    UnknownFormat,
    UnknownModel,
)
from posefield.http.api import problems
from posefield.http.api.problems import TABLE, Kind
from posefield.http.pages import templates


@dataclass(frozen=True)
class Text:
    """Text of one kind of problem.

    comes: cause. remedy: advice to the client. detail, place: of the example.
    """

    comes: str
    remedy: str
    detail: str
    place: Mapping[str, str] = field(default_factory=dict)


TEXTS: dict[Kind, Text] = {
    problems.BAD_PARAMETER: Text(
        "A query parameter or header breaks the contract: it is unknown, missing, given twice, "
        "no finite number, or none of the words that it may be.",
        "Send what `detail` says was expected. Asking again as it was will not help.",
        "fps: 'abc', expected a finite number",
        {"parameter": "fps"},
    ),
    problems.BAD_BODY: Text(
        "The body is no JSON, or has a field that is unknown, missing or of another type.",
        "Compare the field that `pointer` names with the schema of the operation's body.",
        "frames: Object contains unknown field `frames`",
        {"pointer": "/frames"},
    ),
    problems.UNAUTHENTICATED: Text(
        "The service asks for a key or token, and there is none, or one that is unknown, "
        "expired or signed by somebody else. `WWW-Authenticate` says which.",
        "Send `Authorization: Bearer` and a key of the operator's, or a fresh token.",
        "no Authorization; expected a key or token that is known",
    ),
    problems.FORBIDDEN: Text(
        "The key or token holds, but not for this: it lacks the scope that `WWW-Authenticate` "
        "names. Models that a key may not read are answered as `unknown-model` instead.",
        "Ask the operator for a key with that scope.",
        "the key or token has no scope 'metrics' for anything",
    ),
    problems.NO_SUCH_PATH: Text(
        "No operation lies at this path. A slash at its end counts.",
        "Look the path up in the contract, at `/docs` or `/openapi.yaml`.",
        "'/v1/models/'; /openapi.yaml names what there is",
    ),
    TABLE[UnknownModel]: Text(
        "No model of that name, or of that name and hash, answers here, or none that the key "
        "may read. A hash goes when newer versions of a model have pushed it out.",
        "Ask `/v1/models` which there are. Under its plain name a model's newest version answers.",
        "model: no model 'reich'; there are reach@0123456789abcdef",
        {"parameter": "model"},
    ),
    TABLE[UnknownFormat]: Text(
        "The path ends in a format that this service does not write.",
        "Choose one of those that `detail` lists, or leave the ending out and send `Accept`.",
        "format: no format 'fbx'; there are usda, usdc, usdz, json, bvh, glb, npz, arrow, msgpack",
        {"parameter": "format"},
    ),
    problems.METHOD_NOT_ALLOWED: Text(
        "The path is there, but does not take this method.",
        "Use one of the methods in the header `Allow`.",
        "PUT, expected one of GET, HEAD, OPTIONS, POST",
    ),
    problems.NOT_ACCEPTABLE: Text(
        "The header `Accept` accepts none of the formats that the path can answer in.",
        "Accept one of those that `detail` lists, or ask at a path that ends in a format.",
        "Accept 'text/html', expected one of application/json, application/vnd.msgpack, "
        "application/x-npz, application/vnd.apache.arrow.stream",
    ),
    problems.BODY_TOO_LARGE: Text(
        "The body is larger than the operation takes. It was not read to its end, and the "
        "connection is closed.",
        "Ask in several requests, or have the operator raise the limit.",
        "more than 65536 bytes, expected at most 65536",
    ),
    problems.URL_TOO_LONG: Text(
        "The URL is longer than the service reads.",
        "Ask by POST: each question that a URL can hold can also be a JSON body.",
        "expected at most 8192 bytes",
    ),
    problems.NOT_JSON: Text(
        "The body's `Content-Type` is missing or not one that the operation takes.",
        "Send `Content-Type: application/json`, in UTF-8.",
        "Content-Type 'text/plain', expected 'application/json'",
    ),
    TABLE[InvalidField]: Text(
        "The request keeps the contract, but this model has no answer to it: a control is "
        "unknown (or one of a crowd's missing), a value is far outside what was sampled, a time "
        "lies outside the clip, there would be too many frames, the model knows no such performer.",
        "Change the field that `errors` names. The model's card says what the model has: its "
        "controls, their ranges, its performers and levels.",
        "fps: 10000 frames a second, expected 1 to 1000 frames a second",
        {"parameter": "fps"},
    ),
    TABLE[OutsideSamples]: Text(
        "Controls lie outside what the model was trained from, or in a gap of it, and "
        "`extrapolate=refuse` asked for an error rather than a warning.",
        "Move the controls into the ranges on the model's card and near to clips that were "
        "captured, which `why` names, or ask with `extrapolate=warn`.",
        "controls: turn = 60 deg lies outside what was sampled, -45 to 45 deg",
        {"parameter": "controls"},
    ),
    TABLE[OutOfReach]: Text(
        "The motion cannot meet a target, or a measured control, by going as far as captured "
        "motions stray, and `extrapolate=refuse` asked for an error rather than a warning.",
        "Move the target that `errors` names nearer, or ask with `extrapolate=warn`: the answer "
        "then goes as near as it can, and its trust says by how much it misses.",
        "targets/0: RightHand at end stays 446.2 cm from its target: out of reach",
        {"parameter": "target"},
    ),
    problems.HEAD_TOO_LARGE: Text(
        "All header lines together are longer than the service reads.",
        "Send fewer or shorter headers; cookies are never looked at.",
        "expected at most 16384 bytes in at most 100 headers",
    ),
    problems.UNKNOWN_HOST: Text(
        "The header `Host` names neither an address nor a name that the operator has listed. "
        "A page of another origin could otherwise read a service on the same machine (DNS "
        "rebinding).",
        "Ask under a listed name, or list the name in `POSEFIELD_HOSTS`.",
        "'evil.example', expected an address or one of localhost (POSEFIELD_HOSTS)",
    ),
    problems.INTERNAL: Text(
        "The service failed. The request is not at fault.",
        "Tell the operator `instance`: the service's log has the fault under that id. The same "
        "request may be sent again, as no request changes anything.",
        "see the service's log under the id in `instance`",
    ),
    problems.OVERLOADED: Text(
        "More requests are open than the service answers at a time. Nothing was asked of a model.",
        "Send the same request again after as many seconds as `Retry-After` says.",
        "1000 requests are being answered",
    ),
    problems.LATE: Text(
        "The answer had not begun when its time was over: the operator's limit, or the shorter "
        "one that the request asked for by `Prefer: wait=`.",
        "Send again after `Retry-After`, or ask for less at a time: fewer frames, clips or "
        "characters.",
        "no answer within 30 s",
    ),
    problems.NOT_READY: Text(
        "Only `/readyz` and its like answer so: there is no model, one of them fails its trial "
        "question, or the service has been told to end.",
        "Send requests to another instance. What is still sent to this one is answered.",
        "there is no model",
    ),
}


def content() -> bytes:
    """Return the HTML of the page: all kinds of problems, sorted by status."""
    kinds = sorted(TEXTS, key=lambda kind: kind.status)
    listed = [
        {"kind": kind, "text": TEXTS[kind], "example": json.dumps(example(kind), indent=2)}
        for kind in kinds
    ]
    return templates.render("problems.html", title="Problems", problems=listed).encode()


def example(kind: Kind) -> dict[str, object]:
    """Return an example of a problem document of a kind."""
    text = TEXTS[kind]
    # Details of a QueryError begin with the field's name, which `errors` omits.
    named = kind in (*problems.TABLE.values(), problems.BAD_PARAMETER, problems.BAD_BODY)
    said = text.detail.partition(": ")[2] if named else text.detail
    errors = [{**text.place, "detail": said}] if text.place else []
    return problems.document(kind, text.detail, "3f9c0b7a5d21", errors)
