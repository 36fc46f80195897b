"""Requests with files as results: clips, archives of clips, crowds, in several formats."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Literal

import msgspec

from posefield_client import asking, holding
from posefield_client.archives import Entry
from posefield_client.errors import WrongQuestion
from posefield_client.generated import (
    OPERATIONS,
    Camera,
    ClipQuestion,
    ClipsQuestion,
    CrowdQuestion,
    ManifestEntry,
    NamedClipQuestion,
)
from posefield_client.holding import Exact, FloorValue, Targets
from posefield_client.questions import Controls, Extrapolate, Labels
from posefield_client.wire import Request

Root = Literal["travelling", "in_place"]
Feet = Literal["stand", "as_predicted"]
Names = Literal["own", "mixamo", "ue5", "vrm", "humanik"]
Instancing = Literal["references", "scenegraph", "flatten"]
Body = Literal["none", "mannequin", "bones"]
ClipFormat = Literal["usda", "usdc", "usdz", "json", "bvh", "glb", "npz", "arrow", "msgpack"]
Place = Sequence[float]


CLIP, CLIPS, CROWD, WALK = (
    tuple(OPERATIONS[f"{name}InFormat"].formats)
    for name in ("getClip", "queryClips", "queryCrowd", "getCrowd")
)
"""Formats that end a path of the contract."""


@dataclass(frozen=True)
class Files:
    """Request with a file as result.

    count: number of clips of an archive, else None. about: model and question, for people. entry:
    form of the lines of an archive's manifest.
    """

    formats: tuple[str, ...]
    ask: Callable[[str], Request]
    count: int | None = None
    about: str = ""
    entry: type[Entry] = ManifestEntry

    def request(self, ending: str) -> Request:
        """Return the request for a format; WrongQuestion for an unknown one."""
        if ending not in self.formats:
            hint = asking.did_you_mean(ending, self.formats)
            known = ", ".join(self.formats)
            raise WrongQuestion(f"format {ending!r}{hint}, expected one of {known}")
        return self.ask(ending)

    def ending(self, path: Path) -> str:
        """Return the format of a path's suffix; WrongQuestion for an unknown one."""
        found = path.suffix.removeprefix(".").lower()
        if found not in self.formats:
            raise WrongQuestion(f"{path.name} ends in none of .{', .'.join(self.formats)}")
        return found


def clip(
    model: str,
    /,
    *,
    fps: float | None = None,
    start: float | None = None,
    end: float | None = None,
    loop: bool | None = None,
    root: Root | None = None,
    level: int | None = None,
    performer: str | None = None,
    labels: Labels | None = None,
    names: Names | None = None,
    joint_sigma: bool | None = None,
    unit: Literal["m", "cm"] | None = None,
    up: Literal["y", "z"] | None = None,
    body: Body | None = None,
    character: str | None = None,
    extrapolate: Extrapolate | None = None,
    exact: Exact | None = None,
    targets: Targets | None = None,
    feet: Feet | None = None,
    floor: FloorValue | None = None,
    take: int | None = None,
    variety: float | None = None,
    detail: bool | None = None,
    controls: Controls | None = None,
    **named: float,
) -> Files:
    """Return a clip; the request is sent when it is saved or its numbers are read."""
    question = ClipQuestion(
        controls=asking.controls(controls, named),
        **asking.said(fps=fps, start=start, end=end, extrapolate=extrapolate, performer=performer),
        **asking.said(level=level, names=names, root=root, loop=loop, unit=unit, up=up),
        **asking.said(
            body=body, joint_sigma=joint_sigma, feet=feet, labels=labels, character=character
        ),
        **asking.said(take=take, variety=variety, detail=detail),
        **holding.said(exact, targets),
        **holding.floor(floor),
    )
    ask = partial(asking.either, "ClipInFormat", model, question)
    return Files(CLIP, ask, about=asking.about(model, question))


def clips(
    model: str,
    /,
    clips: Iterable[NamedClipQuestion | Mapping[str, Any]],
    format: ClipFormat,  # noqa: A002  # the contract's own word
    *,
    unit: Literal["m", "cm"] | None = None,
    up: Literal["y", "z"] | None = None,
    body: Body | None = None,
    character: str | None = None,
) -> Files:
    """Return an archive of many clips of one format, with a manifest."""
    if format not in CLIP:
        hint = asking.did_you_mean(format, CLIP)
        raise WrongQuestion(f"format {format!r}{hint}, expected one of {', '.join(CLIP)}")
    listed = tuple(_named(place, each) for place, each in enumerate(clips))
    question = ClipsQuestion(
        format=format,
        clips=listed,
        **asking.said(unit=unit, up=up, body=body, character=character),
    )
    ask = partial(asking.body, "queryClipsInFormat", model, question)
    return Files(CLIPS, ask, len(listed), f"{model!r}, {len(listed)} clips as {format}")


def _named(place: int, given: NamedClipQuestion | Mapping[str, Any]) -> NamedClipQuestion:
    if isinstance(given, NamedClipQuestion):
        return given
    controls = asking.controls(given.get("controls"), {})
    held = holding.said(given.get("exact"), given.get("targets"))
    plain = {**asking.sayable(f"clip {place}", given), "controls": controls, **held}
    try:
        return msgspec.convert(plain, NamedClipQuestion)
    except msgspec.ValidationError as fault:
        raise WrongQuestion(f"clip {place}: {fault}") from None


def crowd(
    model: str,
    /,
    time: Any,
    *,
    position: Any = None,
    heading: Any = None,
    performer: str | Sequence[str | None] | None = None,
    labels: Mapping[str, Any] | None = None,
    level: int | Sequence[int] | Literal["auto"] | None = None,
    previous_level: Sequence[int] | None = None,
    from_level: Sequence[int] | None = None,
    blend: Any = None,
    camera: Camera | Mapping[str, Any] | None = None,
    pixels: float | None = None,
    budget_ms: float | None = None,
    root: Root | None = None,
    extrapolate: Extrapolate | None = None,
    take: int | Sequence[int] | Literal["index"] | None = None,
    variety: Any = None,
    detail: bool | None = None,
    controls: Mapping[str, Any] | None = None,
    **named: Any,
) -> Files:
    """Return one pose each of many characters.

    Lists and arrays have one value per character; other values hold for all characters.
    """
    given = asking.together(controls, named)
    question = CrowdQuestion(
        controls={name: asking.column(name, values) for name, values in given.items()},
        time=asking.column("time", time),
        **asking.columns(position=position, heading=heading, level=level, blend=blend),
        **asking.columns(previous_level=previous_level, from_level=from_level),
        **asking.said(performer=performer, camera=camera, pixels=pixels, budget_ms=budget_ms),
        **asking.said(root=root, extrapolate=extrapolate, labels=labels, detail=detail),
        **asking.columns(take=take, variety=variety),
    )
    ask = partial(asking.body, "queryCrowdInFormat", model, question)
    return Files(CROWD, ask, about=asking.about(model, question))


def walk(
    model: str,
    /,
    *,
    count: int | None = None,
    motions: int | None = None,
    seconds: float | None = None,
    fps: float | None = None,
    seed: int | None = None,
    labels: Labels | None = None,
    level: int | None = None,
    camera: Place | None = None,
    fov: float | None = None,
    height: float | None = None,
    pixels: float | None = None,
    feet: Feet | None = None,
    take: int | Literal["index"] | None = None,
    variety: float | None = None,
    detail: bool | None = None,
    instancing: Instancing | None = None,
    body: Body | None = None,
) -> Files:
    """Return a walking crowd. camera: position x, y, z, m. labels: of all characters.

    take: "index" gives each motion a take of its own.
    """
    place = (
        None if camera is None else ",".join(map(asking.digits, asking.numbers("camera", camera)))
    )
    words = {
        **asking.said(count=count, motions=motions, seconds=seconds, fps=fps, seed=seed),
        **asking.said(level=level, camera=place, fov=fov, height=height, pixels=pixels),
        **asking.said(feet=feet, take=take, variety=variety, detail=detail),
        **asking.said(instancing=instancing, body=body),
        **asking.label_words(labels or {}),
    }
    said = "".join(f", {name}={value!r}" for name, value in words.items())
    return Files(
        WALK, partial(asking.plain, "getCrowdInFormat", model, words), about=f"{model!r}{said}"
    )
