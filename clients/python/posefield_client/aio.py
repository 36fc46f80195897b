"""Asynchronous client; `client.py` is made from this file by clients/python/generate.py."""

import io
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from os import PathLike
from pathlib import Path
from typing import Any, Generic, Literal, TypeVar, Unpack

import anyio
import httpx

from posefield_client import numbers, questions, saving, wire
from posefield_client.errors import NoSuchPath, PosefieldError, Unexpected, WrongQuestion
from posefield_client.generated import (
    CONTRACT,
    Body,
    Camera,
    CharacterList,
    Control,
    Extrapolate,
    FeetMode,
    Limits,
    Liveness,
    ModelCard,
    ModelList,
    ModelSummary,
    NamedClipQuestion,
    Names,
    PerformanceEntry,
    PerformanceLayout,
    PerformanceReport,
    Readiness,
    Reasons,
    Root,
    Suggestions,
    Unit,
    Up,
)
from posefield_client.numbers import (
    Arrays,
    ClipNumbers,
    CrowdPoses,
    PerformanceNumbers,
    Pose,
    SigmaGrid,
)
from posefield_client.questions import Controls, Exact, Files, FloorValue, Labels, Targets, Times
from posefield_client.saving import Part, Saved, Watch
from posefield_client.scripts import AnyScript, Planned, ScriptOptions, document
from posefield_client.wire import Cache, Call, Reply, Retry, Sink

T = TypeVar("T")
N = TypeVar("N", bound=Arrays)

MODELS, CHARACTERS = wire.document(ModelList), wire.document(CharacterList)
LIVENESS, READINESS = wire.document(Liveness), wire.document(Readiness)
CARD, REASONS = wire.document(ModelCard), wire.document(Reasons)
SUGGESTIONS, PLAN = wire.document(Suggestions), wire.document(Planned)
POSE, SIGMA = numbers.decoder(Pose), numbers.decoder(SigmaGrid)
CLIP, CROWD = numbers.decoder(ClipNumbers), numbers.decoder(CrowdPoses)
PERFORMANCE = numbers.decoder(PerformanceNumbers)


class AsyncClient:
    """Client of a service at an address.

    key: an API key or token. timeout: seconds without data from the service. cache_bytes: limit of
    the responses that are cached in memory. transport: of httpx, in place of connections. checks:
    unknown controls of clips and crowds are refused at the call, for which the card is read; the
    asynchronous client refuses them there once its card has been read, else when awaited.
    """

    def __init__(
        self,
        base_url: str,
        key: str | None = None,
        *,
        timeout: float | httpx.Timeout = 30.0,
        retry: Retry = Retry(),  # noqa: B008  # it is frozen
        cache_bytes: int = 16 * 2**20,
        transport: httpx.AsyncBaseTransport | None = None,
        checks: bool = True,
    ) -> None:
        self.checks = checks
        self.address = wire.address(base_url)
        headers = wire.client_headers(key)
        self._http = httpx.AsyncClient(headers=headers, timeout=timeout, transport=transport)
        self._retry = retry
        self._cache = Cache(cache_bytes)

    def __repr__(self) -> str:
        return f"AsyncClient({self.address!r})"

    def model(self, name: str) -> "AsyncModel":
        """Return a model by name or name@hash, without a request."""
        return AsyncModel(self, questions.model_name(name))

    async def models(self) -> tuple[ModelSummary, ...]:
        """Return the models of the service."""
        listed = await self.ask(questions.get("listModels", "", {}, MODELS))
        return listed.models

    async def characters(self) -> CharacterList:
        """Return the characters of users, to which motions are delivered."""
        return await self.ask(questions.get("listCharacters", "", {}, CHARACTERS))

    async def live(self) -> Liveness:
        """Return the liveness of the process, with its contract version."""
        return await self.ask(questions.get("getLiveness", "", {}, LIVENESS))

    async def ready(self) -> Readiness:
        """Return the loaded models; NotReady if the service is not ready."""
        return await self.ask(questions.get("getReadiness", "", {}, READINESS))

    async def plan(
        self, script: AnyScript, /, **options: Unpack[ScriptOptions]
    ) -> PerformanceReport:
        """Return the plan of a performance: timeline, joins, targets, warnings, without poses."""
        body = document(script, options)
        call = questions.post("queryPerformance", "", body, PLAN, query="?plan=true")
        planned = await self.ask(call)
        return planned.trust

    def performance(
        self,
        script: AnyScript,
        /,
        *,
        layout: PerformanceLayout | None = None,
        user_character: str | None = None,
        **options: Unpack[ScriptOptions],
    ) -> "AsyncMotion[PerformanceNumbers]":
        """Return a performance; the request is sent when it is saved or its numbers are read.

        layout: "segments" adds an animation of each segment to USD files. user_character: name of
        a character of the service, one of `characters()`, that moves instead of that of the script.
        """
        body = document(script, options)
        words = questions.question({"layout": layout, "character": user_character})
        query = "?" + "&".join(f"{key}={value}" for key, value in words.items()) if words else ""
        name = "queryPerformanceInFormat"
        call = partial(questions.post, name, "", body, query=query)
        about = f"{len(body.get('segments', ()))} segments"
        return AsyncMotion(self, Files(call, name, about), PERFORMANCE)

    def performances(
        self,
        scripts: Iterable[AnyScript],
        format: str,  # noqa: A002  # the contract's own word
        *,
        layout: PerformanceLayout | None = None,
        user_character: str | None = None,
    ) -> "AsyncSaving":
        """Return an archive of many performances of one format, with a manifest.

        A script may have a `name`, that of its file. layout, user_character: as for `performance`.
        """
        listed = [document(script, {}) for script in scripts]
        words = {"layout": layout, "character": user_character, "scripts": listed}
        body = questions.question({"format": format, **words})
        name = "queryPerformancesInFormat"
        call = partial(questions.post, name, "", body)
        about = f"{len(listed)} performances as {format}"
        return AsyncSaving(self, Files(call, name, about, len(listed), PerformanceEntry))

    async def close(self) -> None:
        """Close all connections."""
        await self._http.aclose()

    async def __aenter__(self) -> "AsyncClient":
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.close()

    async def ask(self, call: Call[T], sink: Sink | None = None) -> T:
        """Return the decoded response to a request, from the cache or over HTTP with retries.

        sink: receives the content, which is then not cached; None to hold it in memory. Decoding
        is part of each attempt, and precedes caching. Raises PosefieldError.
        """
        began, attempts = time.monotonic(), 0
        while True:
            attempts += 1
            try:
                return await self._ask_once(call, sink)
            except Unexpected as error:
                error.service = await self._contract()
                raise
            except PosefieldError as error:
                if (
                    isinstance(error, NoSuchPath)
                    and (service := await self._contract()) != CONTRACT
                ):
                    error.add_note(f"service: contract {service}; this client: {CONTRACT}")
                wait = self._retry.wait(attempts, error, time.monotonic() - began)
                if wait is None:
                    raise
            await anyio.sleep(wait)

    async def _ask_once(self, call: Call[T], sink: Sink | None) -> T:
        is_cached = call.body is None and sink is None
        kept = self._cache.find(call.target) if is_cached else None
        if kept is not None and kept.is_fresh():
            return call.decode(kept)
        reply = await self._send(call, kept, sink)
        if kept is not None and reply.status == 304:
            self._cache.renew(call.target, kept, reply.headers)
            return call.decode(kept)
        wire.check(call, reply)
        answer = call.decode(reply)
        if is_cached:
            self._cache.keep(call.target, reply)
        return answer

    async def _send(self, call: Call[T], kept: Reply | None, sink: Sink | None) -> Reply:
        if self._http.is_closed:
            raise WrongQuestion("the client is closed")
        request = self._http.build_request(
            call.operation.method,
            self.address + call.target,
            content=call.body,
            headers=wire.call_headers(call, kept, sink),
        )
        response = None
        try:
            response = await self._http.send(request, stream=True)
            if sink is None or response.status_code != 200:
                content = await response.aread()
                return Reply(response.status_code, response.headers, content)
            wire.begin(call, response.headers, sink)
            async for chunk in response.aiter_bytes():
                sink.write(chunk)
            return Reply(response.status_code, response.headers, b"")
        except httpx.HTTPError as error:
            raise wire.connection_error(call, error, response is not None) from error
        finally:
            if response is not None:
                await response.aclose()

    async def _contract(self) -> str | None:
        """Return the contract version that the service reports; None if it reports none."""
        call = questions.get("getLiveness", "", {}, LIVENESS)
        try:
            live = await self._ask_once(call, None)
        except PosefieldError:
            return None
        return live.contract


class AsyncSaving:
    """Request that is sent when its result is saved or read. files: the request by format."""

    def __init__(self, client: AsyncClient, files: Files) -> None:
        self._client = client
        self.files = files

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.files.about})"

    async def save(self, path: str | PathLike[str], progress: Watch | None = None) -> Saved:
        """Write the result to a file atomically; the end of its name selects the format."""
        form = self.files.ending(Path(path).name)
        part = Part(Path(path), progress)
        call = self.files.request(form, partial(part.saved, form, self.files))
        with part:
            saved = await self._client.ask(call, part)
            part.keep()
        return saved

    async def content(self, format: str) -> bytes:  # noqa: A002  # the contract's own word
        """Return the result as bytes in a format."""

        def read(reply: Reply) -> bytes:
            saving.entries(io.BytesIO(reply.content), format, self.files)
            return reply.content

        return await self._client.ask(self.files.request(format, read))


class AsyncMotion(AsyncSaving, Generic[N]):
    """A clip, a performance, or one pose each of many characters."""

    def __init__(self, client: AsyncClient, files: Files, read: Callable[[Reply], N]) -> None:
        super().__init__(client, files)
        self._read = read
        self._numbers: N | None = None

    @property
    async def numbers(self) -> N:
        """Return the result as arrays, requested once."""
        if self._numbers is not None:
            return self._numbers
        answer = await self._client.ask(self.files.request("msgpack", self._read))
        self._numbers = answer
        return answer

    @property
    async def trust(self) -> Any:
        """Return the Trust of a clip or the report of a performance; its numbers are requested."""
        numbers = await self.numbers
        return getattr(numbers, "trust", None)


class AsyncModel:
    """A model of a service, by name.

    Controls are keywords, or a mapping `controls` for names that Python reserves. Arguments that
    are left out take the defaults of the service's contract.
    """

    def __init__(self, client: AsyncClient, name: str) -> None:
        self.client = client
        self.name = name
        self._card: ModelCard | None = None

    def __repr__(self) -> str:
        return f"AsyncModel({self.name!r})"

    @property
    async def card(self) -> ModelCard:
        """Return the model card, requested once."""
        if self._card is None:
            self._card = await self.client.ask(questions.get("getModel", self.name, {}, CARD))
        return self._card

    @property
    async def controls(self) -> dict[str, Control]:
        """Return the controls by name, in the card's order."""
        card = await self.card
        return {control.name: control for control in card.controls}

    def _check(self, words: Mapping[str, Any]) -> None:
        """Raise WrongQuestion for a control that the model does not have."""
        # The client that waits asks for the card; this one cannot before it is awaited.
        card = self._card  # synchronous: self.card if self.client.checks else self._card
        if card is not None and self.client.checks:
            known = [control.name for control in card.controls]
            questions.check_names(words.get("controls", ()), known)

    async def character(self) -> bytes:
        """Return the character at rest as binary glTF: joints and the body skinned to them."""
        call = questions.get("getCharacter", self.name, {}, lambda reply: reply.content)
        return await self.client.ask(call)

    async def pose(
        self,
        /,
        times: Times,
        *,
        performer: str | None = None,
        labels: Labels | None = None,
        level: int | None = None,
        joint_sigma: bool | None = None,
        extrapolate: Extrapolate | None = None,
        exact: Exact | None = None,
        targets: Targets | None = None,
        take: int | None = None,
        variety: float | None = None,
        detail: bool | None = None,
        controls: Controls | None = None,
        **named: float,
    ) -> Pose:
        """Return poses at one or more times, s, with constraints if given."""
        words = questions.question(locals())
        return await self.client.ask(
            questions.ask("PoseInFormat", self.name, words, POSE, "msgpack")
        )

    async def why(
        self,
        /,
        *,
        nearest: int | None = None,
        performer: str | None = None,
        labels: Labels | None = None,
        extrapolate: Extrapolate | None = None,
        controls: Controls | None = None,
        **named: float,
    ) -> Reasons:
        """Return the captured clips nearest to these controls, and their weights."""
        words = questions.question(locals())
        return await self.client.ask(questions.ask("Why", self.name, words, REASONS))

    async def suggest(
        self,
        /,
        *,
        count: int | None = None,
        performer: str | None = None,
        labels: Labels | None = None,
    ) -> Suggestions:
        """Return the clips to capture next. performer, labels: whose clips count as captured."""
        words = questions.question(locals())
        return await self.client.ask(questions.get("getSuggestions", self.name, words, SUGGESTIONS))

    async def sigma(
        self,
        /,
        across: str,
        along: str,
        *,
        columns: int | None = None,
        rows: int | None = None,
        margin: float | None = None,
        performer: str | None = None,
        labels: Labels | None = None,
        controls: Controls | None = None,
        **named: float,
    ) -> SigmaGrid:
        """Return sigma over the ranges of two controls, extended by a share `margin`."""
        words = questions.question(locals())
        return await self.client.ask(
            questions.ask("SigmaInFormat", self.name, words, SIGMA, "msgpack")
        )

    def clip(
        self,
        /,
        *,
        fps: float | None = None,
        start: float | None = None,
        end: float | None = None,
        loop: bool | None = None,
        root: Root = None,
        level: int | None = None,
        performer: str | None = None,
        labels: Labels | None = None,
        names: Names | None = None,
        joint_sigma: bool | None = None,
        unit: Unit = None,
        up: Up = None,
        body: Body = None,
        character: str | None = None,
        extrapolate: Extrapolate | None = None,
        exact: Exact | None = None,
        targets: Targets | None = None,
        feet: FeetMode = None,
        floor: FloorValue | None = None,
        limits: Limits | None = None,
        take: int | None = None,
        variety: float | None = None,
        detail: bool | None = None,
        controls: Controls | None = None,
        **named: float,
    ) -> "AsyncMotion[ClipNumbers]":
        """Return a clip; the request is sent when it is saved or its numbers are read."""
        words = questions.question(locals())
        self._check(words)
        call = partial(questions.ask, "ClipInFormat", self.name, words)
        files = Files(call, "getClipInFormat", questions.about(self.name, words))
        return AsyncMotion(self.client, files, CLIP)

    def clips(
        self,
        clips: Iterable[NamedClipQuestion | Mapping[str, Any]],
        format: str,  # noqa: A002  # the contract's own word
        *,
        unit: Unit = None,
        up: Up = None,
        body: Body = None,
        character: str | None = None,
    ) -> "AsyncSaving":
        """Return an archive of many clips of one format, with a manifest."""
        words = questions.question(locals())
        count = len(words["clips"])
        name = "queryClipsInFormat"
        call = partial(questions.post, name, self.name, words)
        about = f"{self.name!r}, {count} clips as {format}"
        return AsyncSaving(self.client, Files(call, name, about, count))

    def crowd(
        self,
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
        root: Root = None,
        extrapolate: Extrapolate | None = None,
        take: int | Sequence[int] | Literal["index"] | None = None,
        variety: Any = None,
        detail: bool | None = None,
        controls: Mapping[str, Any] | None = None,
        **named: Any,
    ) -> "AsyncMotion[CrowdPoses]":
        """Return one pose each of many characters.

        Lists and arrays have one value per character; other values hold for all characters.
        """
        words = questions.question(locals())
        self._check(words)
        name = "queryCrowdInFormat"
        call = partial(questions.post, name, self.name, words)
        files = Files(call, name, questions.about(self.name, words))
        return AsyncMotion(self.client, files, CROWD)

    def crowd_walk(
        self,
        /,
        *,
        count: int | None = None,
        motions: int | None = None,
        seconds: float | None = None,
        fps: float | None = None,
        seed: int | None = None,
        labels: Labels | None = None,
        level: int | None = None,
        camera: Sequence[float] | None = None,
        fov: float | None = None,
        height: float | None = None,
        pixels: float | None = None,
        feet: FeetMode = None,
        take: int | Literal["index"] | None = None,
        variety: float | None = None,
        detail: bool | None = None,
        instancing: Literal["references", "scenegraph", "flatten"] | None = None,
        body: Body = None,
    ) -> "AsyncSaving":
        """Return a walking crowd. camera: position x, y, z, m. labels: of all characters.

        take: "index" gives each motion a take of its own.
        """
        words = questions.question(locals())
        name = "getCrowdInFormat"
        call = partial(questions.get, name, self.name, words)
        return AsyncSaving(self.client, Files(call, name, questions.about(self.name, words)))

    def tracks(
        self,
        /,
        tracks: Sequence[Mapping[str, Any]],
        *,
        skip_bad: bool | None = None,
        fps: float | None = None,
        seed: int | None = None,
        labels: Labels | None = None,
        level: int | None = None,
        feet: FeetMode = None,
        take: int | Literal["index"] | None = None,
        variety: float | None = None,
        detail: bool | None = None,
        instancing: Literal["references", "scenegraph", "flatten"] | None = None,
        body: Body = None,
    ) -> "AsyncSaving":
        """Return people who follow tracks: each has an id, times (s), and positions (m).

        Positions are east and north; headings, if there are any, are angles from east, rad.
        """
        words = questions.question(locals())
        name = "queryTracksInFormat"
        call = partial(questions.post, name, self.name, words)
        about = f"{self.name!r}, {len(tracks)} tracks"
        return AsyncSaving(self.client, Files(call, name, about))
