"""Operations that answer with crowds: poses of many characters, and walking crowds.

All lists of a body are columns of the same length, the number of characters; a scalar applies to
each of them. Without a list there is one character.
"""

from collections.abc import Iterator, Sequence
from itertools import chain
from typing import Annotated, Any, Literal

import msgspec
import numpy as np
from starlette.responses import Response

from posefield.common.errors import FormError, InvalidField
from posefield.common.units import Floats, Indices
from posefield.encode import character, crowd_size
from posefield.encode.crowd_size import CrowdCounts
from posefield.encode.formats import (
    CROWD_ENCODERS,
    CROWD_FORMATS,
    max_poses,
)
from posefield.http import responses
from posefield.http.api.problems import BODY_TOO_LARGE, RequestError
from posefield.http.api.settings import Settings
from posefield.http.batching import CROWD_LIMITER, run_in_thread
from posefield.http.request import ServiceRequest, read_body
from posefield.inference.level_selection import Camera, LevelCriteria
from posefield.locomotion import walking_crowd
from posefield.model_file.model_card import ModelCard
from posefield.motion.clip import CrowdClip, Placement
from posefield.question import json_decoding as bodies
from posefield.question.motion_question import (
    DEFAULT_BODY,
    MAX_TAKE,
    ExtrapolationPolicy,
    LabelValue,
    RootMode,
)
from posefield.question.walk_question import DEFAULT_PIXELS, WalkQuestion
from posefield.synthesis import crowd_synthesis, walking_feet
from posefield.validation.crowd_validation import (
    Blending,
    CharacterTakes,
    CrowdQuestion,
    LabelColumn,
)

# The default of Accept is binary USD.
WALK_FORMATS = {"usdc": CROWD_FORMATS["usdc"], **CROWD_FORMATS}
VALUES, FEWEST = 64, 100_000
"""Maximum values of a character, and minimum number of characters that the limit allows for."""
# float, since JSON has one number type: 1.0 is a valid level.
Level = Annotated[float, msgspec.Meta(ge=0, le=127)]
Seed = Annotated[float, msgspec.Meta(ge=0, le=MAX_TAKE)]
Share = Annotated[float, msgspec.Meta(ge=0, le=1)]
Numbers = float | list[float]


class CameraBody(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Camera (schema of the contract)."""

    position: tuple[float, float, float]
    fov: float
    height: float


class CrowdBody(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """CrowdQuestion (schema of the contract)."""

    controls: dict[str, Numbers]
    time: Numbers
    position: list[tuple[float, float, float]] | None = None
    heading: Numbers = 0.0
    performer: str | list[str | None] | None = None
    labels: dict[str, LabelValue | list[LabelValue | None]] = {}
    level: Level | list[Level] | Literal["auto"] = 0.0
    previous_level: list[Level] | None = None
    from_level: list[Level] | None = None
    blend: Share | list[Share] | None = None
    camera: CameraBody | None = None
    pixels: Annotated[float, msgspec.Meta(ge=0)] | None = None
    budget_ms: Annotated[float, msgspec.Meta(gt=0)] | None = None
    root: RootMode = "travelling"
    extrapolate: ExtrapolationPolicy = "warn"
    take: Seed | list[Seed] | Literal["index"] = 0.0
    variety: Share | list[Share] = 0.7
    detail: bool = False


def of_body(content: bytes, largest: float) -> CrowdQuestion:
    """Return the question of a JSON body.

    largest: maximum number of characters. Raises FormError for a malformed body, InvalidField for
    invalid values and RequestError 413 for too many values.
    """
    check_values(content, largest)
    body = bodies.decode_question(CrowdBody, content)
    count = _count(body, largest)
    performers, performer = _distinct(body.performer, count)
    return CrowdQuestion(
        {name: _column(values, count) for name, values in body.controls.items()},
        _column(body.time, count),
        Placement(_positions(body.position, count), _column(body.heading, count)),
        performers,
        performer,
        _detail(body, count),
        body.root,
        body.extrapolate,
        _blending(body, count),
        {
            name: LabelColumn(*_distinct(label_values, count))
            for name, label_values in body.labels.items()
        },
        _takes(body, count),
    )


def check_values(content: bytes, largest: float) -> None:
    """Raise RequestError for more values than a valid body has: decoded, each takes 32 bytes."""
    count, limit = content.count(b","), VALUES * max(largest, FEWEST)
    if count > limit:
        raise RequestError(BODY_TOO_LARGE, f"{count} values, expected at most {limit:.0f}")


def _count(body: CrowdBody, largest: float) -> int:
    """Return the number of characters; raises InvalidField for lists of different lengths."""
    fields = {f"controls/{name}": values for name, values in body.controls.items()} | {
        name: getattr(body, name) for name in CrowdBody.__struct_fields__ if name != "controls"
    }
    fields |= {f"labels/{name}": values for name, values in body.labels.items()}
    sizes = {name: len(values) for name, values in fields.items() if isinstance(values, list)}
    first, count = next(iter(sizes.items()), ("", 1))
    for name, size in sizes.items():
        if not 1 <= size <= largest:
            raise InvalidField(name, f"{size} characters, expected 1 to {largest:.0f}")
        if size != count:
            raise InvalidField(name, f"{size} characters, expected {count} as in {first}")
    return count


def _column(values: Numbers, count: int) -> Floats:
    # np.fromiter takes two thirds of the time of np.array. Adding 0.0 turns -0 into 0.
    column = (
        np.fromiter(values, float, count) if isinstance(values, list) else np.full(count, values)
    )
    return column + 0.0


def _positions(positions: list[tuple[float, float, float]] | None, count: int) -> Floats:
    if positions is None:
        return np.zeros((count, 3))
    # np.fromiter takes half the time of np.array for tuples.
    return (
        np.fromiter(chain.from_iterable(positions), float, 3 * len(positions)).reshape(-1, 3) + 0.0
    )


def _distinct(labels: Any, count: int) -> tuple[tuple[Any, ...], Indices]:
    """Return the distinct labels and the index (N,) of each character's label."""
    if not isinstance(labels, list):
        return (labels,), np.zeros(count, dtype=np.int64)
    # Weights are dicts, which have no hash; their text has quotes, as that of a name.
    values = {repr(label): label for label in labels}
    indices = {key: number for number, key in enumerate(values)}
    index = (indices[repr(label)] for label in labels)
    return tuple(values.values()), np.fromiter(index, np.int64, len(labels))


def _detail(body: CrowdBody, count: int) -> Indices | LevelCriteria:
    if body.level == "auto":
        return _view(body)
    for name in ("previous_level", "camera", "pixels", "budget_ms"):
        if getattr(body, name) is not None:
            raise InvalidField(name, 'given without level "auto", expected only with it')
    return _whole_column("level", body.level, count)


def _whole(name: str, numbers: Sequence[float]) -> Indices:
    """Return whole numbers (N,); FormError for another number."""
    values = np.array(numbers)
    fractional = np.flatnonzero(values % 1.0)
    if len(fractional):
        index, fraction = str(fractional[0]), values[fractional[0]]
        raise FormError(f"{name}/{index}", f"{fraction:g}, expected a whole number")
    return values.astype(np.int64)


def _whole_column(name: str, numbers: Numbers, count: int) -> Indices:
    """Return whole numbers (N,), of a list or of one number for all; FormError for another."""
    if isinstance(numbers, list):
        return _whole(name, numbers)
    return _whole(name, [numbers]).repeat(count)


def _takes(body: CrowdBody, count: int) -> CharacterTakes | None:
    """Return the takes of the characters; "index" is a seed of its own for each, from 1 on."""
    if body.take == 0.0 and not body.detail:
        return None
    if body.take == "index":
        seeds = 1 + np.arange(count)
    else:
        seeds = _whole_column("take", body.take, count)
    return CharacterTakes(seeds, _column(body.variety, count), np.full(count, body.detail))


def _blending(body: CrowdBody, count: int) -> Blending | None:
    if body.from_level is None and body.blend is None:
        return None
    if body.from_level is None or body.blend is None:
        raise InvalidField("blend", "expected from_level and blend, or neither")
    if body.level == "auto" and body.previous_level is None:
        raise InvalidField("previous_level", 'missing; level "auto" with blend holds it')
    return Blending(_whole("from_level", body.from_level), _column(body.blend, count))


def _view(body: CrowdBody) -> LevelCriteria:
    if body.camera is None:
        raise InvalidField("camera", 'missing; level "auto" needs one')
    lens = body.camera
    previous = body.previous_level
    return LevelCriteria(
        Camera(np.array(lens.position), lens.fov, lens.height),
        DEFAULT_PIXELS if body.pixels is None else body.pixels,
        None if body.budget_ms is None else body.budget_ms / 1000.0,
        None if previous is None else _whole("previous_level", previous),
    )


def check_size(question: WalkQuestion, ending: str, card: ModelCard, settings: Settings) -> None:
    """Raise InvalidField for a crowd beyond the limits of the settings.

    ending: extension of the format. card: of the model.
    """
    question.check()
    flat = question.instancing == "flatten"
    if question.count > settings.crowd_limit:
        raise InvalidField("count", f"{question.count}, expected at most {settings.crowd_limit}")
    # A flattened layer has a copy of the motion for each character.
    copies = question.count if flat else question.motions or question.count
    poses = walking_crowd.poses(copies, question.seconds, question.fps)
    if poses > settings.crowd_poses:
        raise InvalidField(
            "count", f"{poses:.3g} poses of all motions, expected at most {settings.crowd_poses}"
        )
    longest = walking_crowd.poses(1, question.seconds, question.fps)
    if longest > settings.crowd_frames:
        raise InvalidField(
            "seconds", f"{longest:.6g} frames of a motion, expected at most {settings.crowd_frames}"
        )
    points = character.body_size(card.skeleton, question.body or DEFAULT_BODY)
    motions = question.motions or question.count
    frames = walking_crowd.frame_count(motions, question.seconds, question.fps, question.seed)
    joints, channels = len(card.skeleton), len(card.curves)
    counts = CrowdCounts(joints, question.count, motions, frames, points, channels)
    size = crowd_size.file_size_bound(counts, ending, flat)
    if size > settings.output_limit:
        raise InvalidField(
            "count",
            f"{size / 1e6:.1f} MB for {question.count} characters and {motions} motions of "
            f"{frames} frames as {ending}, expected at most {settings.output_limit / 1e6:.1f} MB",
        )


async def answer_crowd(request: ServiceRequest) -> Response:
    """Answer with the poses of a crowd of any characters, whose body is decoded in a thread."""
    model, service, settings = request.model, request.service, request.service.settings
    encoder, card = CROWD_ENCODERS[request.format], request.model.session.card
    body = await read_body(request, settings.crowd_body_limit, service.bodies)
    fitting = max_poses(settings.output_limit, len(card.skeleton), encoder, len(card.curves))
    largest = min(settings.crowd_limit, encoder.max_characters, fitting)

    def work() -> bytes:
        question = of_body(body, largest)
        return encoder.encode(crowd_synthesis.synthesize_crowd(model, question))

    content = await run_in_thread(work, limiter=CROWD_LIMITER)
    return responses.attachment(content, encoder, model.name)


async def answer_walk(request: ServiceRequest) -> Response:
    """Answer with a walking crowd as USD, whose motions are computed as they are sent."""
    model, form = request.model, CROWD_FORMATS[request.format]
    question = await request.decode(WalkQuestion)
    check_size(question, form.extension, model.session.card, request.service.settings)

    def work() -> tuple[CrowdClip, Iterator[bytes]]:
        # usd-core takes 0.12 CPU seconds to import.
        from posefield.encode import crowd_writer

        # The gait of a model is measured at its first use.
        crowd = walking_feet.build_crowd(model, model.gait, question)
        body = question.body or DEFAULT_BODY
        return crowd, crowd_writer.stream(crowd, form.extension, question.instancing, body)

    crowd, pieces = await run_in_thread(work, limiter=CROWD_LIMITER)
    share, warnings = float(crowd.facts["outside_share"]), list(crowd.facts.get("warnings", ()))
    if share:
        outside = f"{100 * share:.1f} % of the poses have some control outside what was sampled"
        warnings.insert(0, outside)
    return responses.stream(pieces, form, model.name, warnings, CROWD_LIMITER, model.identity)
