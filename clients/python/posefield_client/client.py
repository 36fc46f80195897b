"""Synchronous client."""

import time
from collections.abc import Callable
from contextlib import closing
from functools import cached_property, partial, wraps
from html import escape
from os import PathLike
from pathlib import Path
from typing import Any, Concatenate, ParamSpec, TypeVar

import httpx

from posefield_client import (
    asking,
    files,
    notebook,
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


def _ask(question: Callable[P, Call[T]]) -> Callable[Concatenate["Client", P], T]:
    """Return a method of the client that sends a request."""

    @wraps(question)
    def method(self: "Client", /, *args: P.args, **kwargs: P.kwargs) -> T:
        return self.run(self.core.answer(question(*args, **kwargs)))

    return method


def _ask_model(
    question: Callable[Concatenate[str, P], Call[T]],
) -> Callable[Concatenate["Model", P], T]:
    """Return a method of the model that sends a request."""

    @wraps(question)
    def method(self: "Model", /, *args: P.args, **kwargs: P.kwargs) -> T:
        call = question(self.name, *args, **kwargs)
        return self.client.run(self.client.core.answer(call))

    return method


def _perform(
    question: Callable[P, Files],
) -> Callable[Concatenate["Client", P], "Performance"]:
    """Return a method of the client that sends its request when the result is read or saved."""

    @wraps(question)
    def method(self: "Client", /, *args: P.args, **kwargs: P.kwargs) -> "Performance":
        return Performance(self, question(*args, **kwargs))

    return method


def _pack(
    question: Callable[P, Files],
) -> Callable[Concatenate["Client", P], "Saving"]:
    """Return a method of the client that sends its request when the archive is saved."""

    @wraps(question)
    def method(self: "Client", /, *args: P.args, **kwargs: P.kwargs) -> "Saving":
        return Saving(self, question(*args, **kwargs))

    return method


def _lazy(
    kind: Callable[["Client", Files], F], question: Callable[Concatenate[str, P], Files]
) -> Callable[Concatenate["Model", P], F]:
    """Return a method of the model that sends its request when the result is read or saved."""

    @wraps(question)
    def method(self: "Model", /, *args: P.args, **kwargs: P.kwargs) -> F:
        return kind(self.client, question(self.name, *args, **kwargs))

    return method


class Client:
    """Client of a service at an address, for one or more threads.

    key: an API key or token. timeout: seconds without data from the service. cache: a folder or a
    Cache; None for a Memory of 16 MiB, NOTHING for no cache. sleep: function that waits for
    seconds.
    """

    def __init__(
        self,
        base_url: str,
        key: str | None = None,
        *,
        timeout: float | httpx.Timeout = 30.0,
        retry: Retry = Retry(),  # noqa: B008  # it is frozen
        cache: Cache | Path | None = None,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self._place = transport.place(base_url, key, timeout)
        self.core: Core = transport.core(self._place, retry, cache)
        self._http = httpx.Client(timeout=timeout)
        self._sleep = sleep

    def __repr__(self) -> str:
        return f"Client({self._place.address!r})"

    models = _ask(questions.models)
    characters = _ask(questions.characters)
    live = _ask(questions.live)
    ready = _ask(questions.ready)
    plan = _ask(performances.plan)
    performance = _perform(performances.performance)
    performances = _pack(performances.performances)

    def model(self, name: str) -> "Model":
        """Return a model by name or name@hash, without a request."""
        return Model(self, asking.model_name(name))

    def close(self) -> None:
        """Close all connections."""
        self._http.close()

    def __enter__(self) -> "Client":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def run(self, steps: Steps[T]) -> T:
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
                    step = partial(steps.send, self._do(wish))
                except PosefieldError as fault:
                    step = partial(steps.throw, fault)

    def _do(self, wish: Send | Sleep) -> Reply | None:
        if isinstance(wish, Sleep):
            self._sleep(wish.seconds)
            return None
        transport.opened(self._http)
        response = None
        try:
            response = self._http.send(self._place.request(wish), stream=True)
            with closing(response):
                return self._read(wish, response)
        except httpx.HTTPError as found:
            raise transport.fault(found, wish, response is not None) from found

    def _read(self, wish: Send, response: httpx.Response) -> Reply:
        take = transport.begin(wish, response)
        if take is None:
            return transport.reply(wish, response, b"".join(response.iter_raw()))
        for chunk in response.iter_raw():
            take(chunk)
        return transport.reply(wish, response, b"")


class Saving:
    """Request that is sent when its result is saved or read."""

    def __init__(self, client: Client, files: Files) -> None:
        self._client = client
        self._files = files

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self._files.about})"

    def save(self, path: str | PathLike[str], progress: Watch | None = None) -> Saved:
        """Write the result to a file atomically; the path's suffix selects the format."""
        return self._client.run(saving.save(self._client.core, self._files, Path(path), progress))

    def content(self, format: str) -> bytes:  # noqa: A002  # the contract's own word
        """Return the result as bytes in a format."""
        return self._client.run(saving.content(self._client.core, self._files, format))

    def _numbers(self, read: Callable[[Reply], T], ending: str = "msgpack") -> T:
        return self._client.run(self._client.core.answer(Call(self._files.request(ending), read)))


class Clip(Saving):
    """A clip of a model."""

    @cached_property
    def numbers(self) -> ClipNumbers:
        """Return the frames as arrays, requested once."""
        return self._numbers(numbers.clip)

    def _repr_html_(self) -> str:
        """Return the moving figure for a notebook, or the reason for which there is none."""
        return _shown(self)


class Performance(Saving):
    """One continuous motion through the segments of a script."""

    @cached_property
    def numbers(self) -> PerformanceNumbers:
        """Return the frames as arrays, requested once."""
        return self._numbers(numbers.performance)

    def _repr_html_(self) -> str:
        """Return the moving figure for a notebook, or the reason for which there is none."""
        return _shown(self)


def _shown(motion: Clip | Performance) -> str:
    """Return a motion as HTML."""
    try:
        return notebook.picture(motion.numbers)
    except PosefieldError as fault:
        return f"<pre>{escape(repr(motion))}: {escape(str(fault))}</pre>"


class Crowd(Saving):
    """One pose each of many characters."""

    @cached_property
    def numbers(self) -> CrowdPoses:
        """Return the poses as arrays, requested once."""
        return self._numbers(numbers.crowd)

    def table(self) -> Any:
        """Return the poses as a pyarrow.Table, one row per character.

        Needs posefield-client[arrow].
        """
        return self._numbers(tables.read, "arrow")


class Model:
    """A model of a service, by name."""

    def __init__(self, client: Client, name: str) -> None:
        self.client = client
        self.name = name

    pose = _ask_model(questions.pose)
    why = _ask_model(questions.why)
    suggest = _ask_model(questions.suggest)
    sigma = _ask_model(questions.sigma)
    read_card = _ask_model(questions.card)
    character = _ask_model(questions.character)
    kernel = _ask_model(questions.kernel)
    clip = _lazy(Clip, files.clip)
    clips = _lazy(Saving, files.clips)
    crowd = _lazy(Crowd, files.crowd)
    crowd_walk = _lazy(Saving, files.walk)

    @cached_property
    def card(self) -> ModelCard:
        """Return the model card, requested once."""
        return self.read_card()

    @cached_property
    def controls(self) -> dict[str, Control]:
        """Return the controls by name, in the card's order."""
        return {control.name: control for control in self.card.controls}

    def __repr__(self) -> str:
        return f"Model({self.name!r})"
