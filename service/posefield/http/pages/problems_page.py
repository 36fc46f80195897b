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
from posefield.http.api.problems import QUERY_ERROR_PROBLEMS, ProblemKind
from posefield.http.pages import templates


@dataclass(frozen=True)
class ProblemText:
    """Text of one kind of problem.

    comes: cause. remedy: advice to the client. detail, place: of the example.
    """

    comes: str
    remedy: str
    detail: str
    place: Mapping[str, str] = field(default_factory=dict)


PROBLEM_TEXTS: dict[ProblemKind, ProblemText] = {
    problems.BAD_PARAMETER: ProblemText(
        "A query parameter or header violates the contract: it is unknown, missing or repeated, or "
        "its value is not a finite number or not one of the allowed words.",
        "Send the value that `detail` expects. The same request will fail again.",
        "fps: 'abc', expected a finite number",
        {"parameter": "fps"},
    ),
    problems.BAD_BODY: ProblemText(
        "The body is not valid JSON, or a field is unknown, missing or of the wrong type.",
        "Compare the field at `pointer` with the schema of the operation's body.",
        "fps: Expected `float`, got `str` 'fast'",
        {"pointer": "/fps"},
    ),
    problems.UNAUTHENTICATED: ProblemText(
        "The service requires a key or a token, and the request has none, or one that is unknown, "
        "expired or signed by an unknown issuer. `WWW-Authenticate` gives the cause.",
        "Send `Authorization: Bearer` with a key from the operator, or with a fresh token.",
        "no Authorization; expected a key or token that is known",
    ),
    problems.FORBIDDEN: ProblemText(
        "The key or token is valid but lacks the scope that `WWW-Authenticate` names. For models "
        "outside a key's scope the problem is `unknown-model` instead.",
        "Ask the operator for a key with that scope.",
        "the key or token has no scope 'metrics' for anything",
    ),
    problems.NO_SUCH_PATH: ProblemText(
        "The contract has no operation at this path. A trailing slash is significant.",
        "Find the path in the contract at `/docs` or `/openapi.yaml`.",
        "'/v1/models/'; /openapi.yaml names what there is",
    ),
    QUERY_ERROR_PROBLEMS[UnknownModel]: ProblemText(
        "The service has no model with this name, or with this name and hash, in the key's scope. "
        "The service removes old hashes when newer versions of a model arrive.",
        "List the models at `/v1/models`. The plain name selects the newest version of a model.",
        "model: no model 'reich' (did you mean 'reach'?); there are reach@0123456789abcdef",
        {"parameter": "model"},
    ),
    QUERY_ERROR_PROBLEMS[UnknownFormat]: ProblemText(
        "The path ends in a format that this operation does not support.",
        "Use one of the formats in `detail`, or omit the ending and send `Accept`.",
        "format: no format 'fbx'; there are usda, usdc, usdz, json, bvh, glb, npz, arrow, msgpack",
        {"parameter": "format"},
    ),
    problems.METHOD_NOT_ALLOWED: ProblemText(
        "The path exists but does not support this method.",
        "Use one of the methods in the header `Allow`.",
        "PUT, expected one of GET, HEAD, OPTIONS, POST",
    ),
    problems.NOT_ACCEPTABLE: ProblemText(
        "The header `Accept` allows none of the formats of this path.",
        "Accept one of the formats in `detail`, or use a path that ends in a format.",
        "Accept 'text/html', expected one of application/json, application/vnd.msgpack, "
        "application/x-npz, application/vnd.apache.arrow.stream",
    ),
    problems.BODY_TOO_LARGE: ProblemText(
        "The body exceeds the limit of the operation. The service did not read it to its end and "
        "closes the connection.",
        "Split the request into several, or ask the operator to raise the limit.",
        "more than 65536 bytes, expected at most 65536",
    ),
    problems.URL_TOO_LONG: ProblemText(
        "The URL exceeds the limit.",
        "Poses, clips, `sigma` and `why` also accept the parameters as the JSON body of a POST.",
        "expected at most 8192 bytes",
    ),
    problems.NOT_JSON: ProblemText(
        "The body's `Content-Type` is missing or not supported by the operation.",
        "Send `Content-Type: application/json`, in UTF-8.",
        "Content-Type 'text/plain', expected 'application/json'",
    ),
    QUERY_ERROR_PROBLEMS[InvalidField]: ProblemText(
        "The request conforms to the contract, but the model cannot respond to it. Causes: an "
        "unknown control (for a crowd, also a missing one), a value far outside the sampled "
        "range, a time outside the clip, too many frames, or an unknown performer.",
        "Change the field that `errors` names. The model's card lists the controls with their "
        "ranges, the performers and the levels.",
        "fps: 10000 frames a second, expected 1 to 1000 frames a second",
        {"parameter": "fps"},
    ),
    QUERY_ERROR_PROBLEMS[OutsideSamples]: ProblemText(
        "Controls lie outside the sampled ranges, or in a gap between the samples, and "
        "`extrapolate=refuse` requests an error instead of a warning.",
        "Move the controls into the ranges on the model's card and near captured clips, which "
        "`why` lists, or send `extrapolate=warn`.",
        "controls: turn = 60 deg lies outside what was sampled, -45 to 45 deg",
        {"parameter": "controls"},
    ),
    QUERY_ERROR_PROBLEMS[OutOfReach]: ProblemText(
        "The motion cannot reach a target, or a measured control, within the deviations of "
        "captured motions, and `extrapolate=refuse` requests an error instead of a warning.",
        "Move the target that `errors` names nearer, or send `extrapolate=warn`: the response "
        "then approaches the target as far as possible, and its trust gives the distance left.",
        "targets/0: RightHand at end stays 446.2 cm from its target: out of reach",
        {"parameter": "target"},
    ),
    problems.HEAD_TOO_LARGE: ProblemText(
        "The header lines together exceed the limit, or there are too many.",
        "Send fewer or shorter headers. The service ignores cookies.",
        "expected at most 16384 bytes in at most 100 headers",
    ),
    problems.UNKNOWN_HOST: ProblemText(
        "The header `Host` is neither an IP address nor a name that the operator has listed. The "
        "check prevents DNS rebinding, by which a page of another origin could read a service on "
        "the same machine.",
        "Use a listed name, or add the name to `POSEFIELD_HOSTS`.",
        "'evil.example', expected an address or one of localhost (POSEFIELD_HOSTS)",
    ),
    problems.INTERNAL: ProblemText(
        "An internal error occurred. The request is not its cause.",
        "Report `instance` to the operator: the service's log contains the error under that id. "
        "The client may repeat the request, because no request changes any state.",
        "see the service's log under the id in `instance`",
    ),
    problems.OVERLOADED: ProblemText(
        "The number of open requests exceeds the limit. The model was not evaluated.",
        "Repeat the request after the number of seconds in `Retry-After`.",
        "1000 requests are being answered",
    ),
    problems.DEADLINE_EXCEEDED: ProblemText(
        "The response did not begin within the time limit: the operator's limit, or the shorter "
        "one that the request sets with `Prefer: wait=`.",
        "Repeat the request after the number of seconds in `Retry-After`, or request fewer frames, "
        "clips or characters.",
        "no answer within 30 s",
    ),
    problems.NOT_READY: ProblemText(
        "Only `/readyz` returns this problem. Causes: the service has no model, a model fails its "
        "trial request, or the service is shutting down.",
        "Send requests to another instance. This instance still responds to requests that it "
        "receives.",
        "there is no model",
    ),
}


def problems_html() -> bytes:
    """Return the HTML of the page: all kinds of problems, sorted by status."""
    kinds = sorted(PROBLEM_TEXTS, key=lambda kind: kind.status)
    listed = [
        {
            "kind": kind,
            "text": PROBLEM_TEXTS[kind],
            "example": json.dumps(problem_example(kind), indent=2),
        }
        for kind in kinds
    ]
    return templates.render("problems.html", title="Problems", problems=listed).encode()


def problem_example(kind: ProblemKind) -> dict[str, object]:
    """Return an example of a problem document of a kind."""
    text = PROBLEM_TEXTS[kind]
    # Details of a QueryError begin with the field's name, which `errors` omits.
    named = kind in (
        *problems.QUERY_ERROR_PROBLEMS.values(),
        problems.BAD_PARAMETER,
        problems.BAD_BODY,
    )
    said = text.detail.partition(": ")[2] if named else text.detail
    errors = [{**text.place, "detail": said}] if text.place else []
    return problems.problem_document(kind, text.detail, "3f9c0b7a5d21", errors)
