"""Asynchronous client, with the requests of `client` as coroutines."""

from collections.abc import Awaitable, Callable, Coroutine
from contextlib import closing
from functools import partial, wraps
from os import PathLike
from pathlib import Path
from typing import Any, Concatenate, ParamSpec, TypeVar

import anyio
import httpx

from posefield_client import (
    asking,
    files,
    numbers,
    performances,
    questions,
    saving,
    tables,
    transport,
)
from posefield_client.cache import Cache
from posefield_client.errors import PosefieldError
from posefield_client.exchange import Core
from posefield_client.files import Files
from posefield_client.generated import Control, ModelCard
from posefield_client.numbers import ClipNumbers, CrowdPoses, PerformanceNumbers
from posefield_client.retry import Retry
from posefield_client.saving import Saved, Watch
from posefield_client.wire import Call, Reply, Send, Sleep, Steps

P = ParamSpec("P")
T = TypeVar("T")
F = TypeVar("F")
Later = Coroutine[Any, Any, T]


def _ask(question: Callable[P, Call[T]]) -> Callable[Concatenate["AsyncClient", P], Later[T]]:
    """Return a method of the client that sends a request."""

    @wraps(question)
    async def method(self: "AsyncClient", /, *args: P.args, **kwargs: P.kwargs) -> T:
        return await self.run(self.core.answer(question(*args, **kwargs)))

    return method


def _ask_model(
    question: Callable[Concatenate[str, P], Call[T]],
) -> Callable[Concatenate["AsyncModel", P], Later[T]]:
    """Return a method of the model that sends a request."""

    @wraps(question)
    async def method(self: "AsyncModel", /, *args: P.args, **kwargs: P.kwargs) -> T:
        call = question(self.name, *args, **kwargs)
        return await self.client.run(self.client.core.answer(call))

    return method


def _perform(
    question: Callable[P, Files],
) -> Callable[Concatenate["AsyncClient", P], "AsyncPerformance"]:
    """Return a method of the client that sends its request when the result is read or saved."""

    @wraps(question)
    def method(self: "AsyncClient", /, *args: P.args, **kwargs: P.kwargs) -> "AsyncPerformance":
        return AsyncPerformance(self, question(*args, **kwargs))

    return method


def _pack(
    question: Callable[P, Files],
) -> Callable[Concatenate["AsyncClient", P], "AsyncSaving"]:
    """Return a method of the client that sends its request when the archive is saved."""

    @wraps(question)
    def method(self: "AsyncClient", /, *args: P.args, **kwargs: P.kwargs) -> "AsyncSaving":
        return AsyncSaving(self, question(*args, **kwargs))

    return method


def _lazy(
    kind: Callable[["AsyncClient", Files], F], question: Callable[Concatenate[str, P], Files]
) -> Callable[Concatenate["AsyncModel", P], F]:
    """Return a method of the model that sends its request when the result is read or saved."""

    @wraps(question)
    def method(self: "AsyncModel", /, *args: P.args, **kwargs: P.kwargs) -> F:
        return kind(self.client, question(self.name, *args, **kwargs))

    return method


class AsyncClient:
    """Client of a service at an address, for one event loop; arguments as `Client`.

    Writes to files and to the disk cache block the event loop for one small write each.
    """

    def __init__(
        self,
        base_url: str,
        key: str | None = None,
        *,
        timeout: float | httpx.Timeout = 30.0,
        retry: Retry = Retry(),  # noqa: B008  # it is frozen
        cache: Cache | Path | None = None,
        sleep: Callable[[float], Awaitable[None]] = anyio.sleep,
    ) -> None:
        self._place = transport.place(base_url, key, timeout)
        self.core: Core = transport.core(self._place, retry, cache)
        self._http = httpx.AsyncClient(timeout=timeout)
        self._sleep = sleep

    def __repr__(self) -> str:
        return f"AsyncClient({self._place.address!r})"

    models = _ask(questions.models)
    characters = _ask(questions.characters)
    live = _ask(questions.live)
    ready = _ask(questions.ready)
    plan = _ask(performances.plan)
    performance = _perform(performances.performance)
    performances = _pack(performances.performances)

    def model(self, name: str) -> "AsyncModel":
        """Return a model by name or name@hash, without a request."""
        return AsyncModel(self, asking.model_name(name))

    async def close(self) -> None:
        """Close all connections."""
        await self._http.aclose()

    async def __aenter__(self) -> "AsyncClient":
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.close()

    async def run(self, steps: Steps[T]) -> T:
        """Run the steps of a generator and return its result. Raises PosefieldError."""
        step = partial(steps.send, None)
        with closing(steps):
            while True:
                try:
                    wish = step()
                except StopIteration as end:
                    found: T = end.value
                    return found
                try:
                    step = partial(steps.send, await self._do(wish))
                except PosefieldError as fault:
                    step = partial(steps.throw, fault)

    async def _do(self, wish: Send | Sleep) -> Reply | None:
        if isinstance(wish, Sleep):
            await self._sleep(wish.seconds)
            return None
        transport.opened(self._http)
        response = None
        try:
            response = await self._http.send(self._place.request(wish), stream=True)
            try:
                return await self._read(wish, response)
            finally:
                await response.aclose()
        except httpx.HTTPError as found:
            raise transport.fault(found, wish, response is not None) from found

    async def _read(self, wish: Send, response: httpx.Response) -> Reply:
        take = transport.begin(wish, response)
        if take is None:
            raw = b"".join([chunk async for chunk in response.aiter_raw()])
            return transport.reply(wish, response, raw)
        async for chunk in response.aiter_raw():
            take(chunk)
        return transport.reply(wish, response, b"")


class AsyncSaving:
    """Request that is sent when its result is saved or read."""

    def __init__(self, client: AsyncClient, files: Files) -> None:
        self._client = client
        self._files = files

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self._files.about})"

    async def save(self, path: str | PathLike[str], progress: Watch | None = None) -> Saved:
        """Write the result to a file atomically; the path's suffix selects the format."""
        steps = saving.save(self._client.core, self._files, Path(path), progress)
        return await self._client.run(steps)

    async def content(self, format: str) -> bytes:  # noqa: A002  # the contract's own word
        """Return the result as bytes in a format."""
        return await self._client.run(saving.content(self._client.core, self._files, format))

    async def _numbers(self, read: Callable[[Reply], T], ending: str = "msgpack") -> T:
        call = Call(self._files.request(ending), read)
        return await self._client.run(self._client.core.answer(call))


class AsyncClip(AsyncSaving):
    """A clip of a model."""

    @property
    def numbers(self) -> Later[ClipNumbers]:
        """Return a coroutine of the frames as arrays."""
        return self._numbers(numbers.clip)


class AsyncPerformance(AsyncSaving):
    """One continuous motion through the segments of a script."""

    @property
    def numbers(self) -> Later[PerformanceNumbers]:
        """Return a coroutine of the frames as arrays."""
        return self._numbers(numbers.performance)


class AsyncCrowd(AsyncSaving):
    """One pose each of many characters."""

    @property
    def numbers(self) -> Later[CrowdPoses]:
        """Return a coroutine of the poses as arrays."""
        return self._numbers(numbers.crowd)

    async def table(self) -> Any:
        """Return the poses as a pyarrow.Table, one row per character.

        Needs posefield-client[arrow].
        """
        return await self._numbers(tables.read, "arrow")


class AsyncModel:
    """A model of a service, by name."""

    def __init__(self, client: AsyncClient, name: str) -> None:
        self.client = client
        self.name = name
        self._card: ModelCard | None = None

    pose = _ask_model(questions.pose)
    why = _ask_model(questions.why)
    suggest = _ask_model(questions.suggest)
    sigma = _ask_model(questions.sigma)
    read_card = _ask_model(questions.card)
    character = _ask_model(questions.character)
    kernel = _ask_model(questions.kernel)
    clip = _lazy(AsyncClip, files.clip)
    clips = _lazy(AsyncSaving, files.clips)
    crowd = _lazy(AsyncCrowd, files.crowd)
    crowd_walk = _lazy(AsyncSaving, files.walk)

    @property
    def card(self) -> Later[ModelCard]:
        """Return a coroutine of the model card, which is cached."""
        return self._read_once()

    @property
    def controls(self) -> Later[dict[str, Control]]:
        """Return a coroutine of the controls by name, in the card's order."""
        return self._controls()

    async def _read_once(self) -> ModelCard:
        if self._card is None:
            self._card = await self.read_card()
        return self._card

    async def _controls(self) -> dict[str, Control]:
        return {control.name: control for control in (await self.card).controls}

    def __repr__(self) -> str:
        return f"AsyncModel({self.name!r})"
