"""Disturbances of the service and its models during requests."""

import asyncio
import os
import random
import signal
import sys
from collections import Counter
from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from time import monotonic

import httpx
from faults_book import Book
from serve_process import POSEFIELD, accepts, children, command, resident

WORKERS = 2
SETTINGS = {
    "POSEFIELD_WORKERS": str(WORKERS),
    "POSEFIELD_RELOAD": "1",
    # Longer than the longest pause of a client that keeps its connection.
    "POSEFIELD_DRAIN": "5",
    # Few, so that the refusal is seen too.
    "POSEFIELD_CONCURRENCY": "12",
}


@dataclass
class Stage:
    """The service, the folder of its models, and two contents of one model.

    The folder has `reaching` with both contents as versions of which the newest changes, and the
    file `plain`, which is replaced. memory: when, process and MB.
    """

    folder: Path
    log: Path
    contents: Sequence[bytes]
    port: int
    book: Book
    child: asyncio.subprocess.Process | None = None
    done: Counter[str] = field(default_factory=Counter)
    memory: list[tuple[float, int, float]] = field(default_factory=list)

    def lay_out(self) -> None:
        """Put the models into the folder."""
        (self.folder / "reaching").mkdir(parents=True)
        for number, content in enumerate(self.contents):
            (self.folder / f"reaching/{number}.onnx").write_bytes(content)
        (self.folder / "plain.onnx").write_bytes(self.contents[0])

    async def start(self) -> None:
        """Start the service; return once it listens."""
        with self.log.open("ab") as log:
            self.child = await asyncio.create_subprocess_exec(
                *(POSEFIELD, "serve", self.folder),
                env={**os.environ, **SETTINGS, "POSEFIELD_PORT": str(self.port)},
                stdout=asyncio.subprocess.PIPE,
                stderr=log,
            )
        assert self.child.stdout
        if not await self.child.stdout.readline():
            sys.exit(f"the service does not start:\n{self.log.read_text()[-3000:]}")
        self.book.listening = True
        await _until(self, self.complete, "not all workers started")

    async def end(self) -> None:
        """Tell the service to end; it does so by itself, and says that all went well."""
        assert self.child
        self.book.listening = False
        self.child.send_signal(signal.SIGTERM)
        try:
            async with asyncio.timeout(30):
                code = await self.child.wait()
        except TimeoutError:
            self.book.fault("SIGTERM: it did not end within 30 s")
            self.child.kill()
            code = await self.child.wait()
        if code:
            self.book.fault(f"SIGTERM: exit code {code}")

    def workers(self) -> list[int]:
        """Process ids of the workers; multiprocessing's tracker of resources is a child, too."""
        if self.child is None or self.child.returncode is not None:
            return []
        return [pid for pid in children(self.child.pid) if b"spawn_main" in command(pid)]

    def complete(self) -> bool:
        """Return whether all workers answer; one that starts cannot open a file that is broken."""
        workers = self.workers()
        return len(workers) == WORKERS and all(accepts(pid, self.port) for pid in workers)

    async def watch(self) -> None:
        """Look at the workers' memory every second."""
        while not self.book.ended:
            for worker in self.workers():
                try:
                    size = resident(worker)
                except OSError:
                    continue
                # One that was killed has none until it is buried.
                if size:
                    self.memory.append((monotonic(), worker, size))
            await asyncio.sleep(1.0)

    async def play(self, seconds: float, rng: random.Random) -> None:
        """Scenes for so many seconds, at least one of each kind."""
        start = monotonic()
        pause = 0.3 if seconds < 120 else 3.0
        rare = [(0.2, killing), (0.5, restarting), (0.75, killing)]
        turn = 0
        while monotonic() - start < seconds or rare or turn < len(MODEL_SCENES):
            await asyncio.sleep(pause)
            if rare and monotonic() - start > rare[0][0] * seconds:
                scene = rare.pop(0)[1]
            else:
                scene, turn = MODEL_SCENES[turn % len(MODEL_SCENES)], turn + 1
            self.book.scene = monotonic(), scene.__name__
            await scene(self, rng)
            self.done[scene.__name__] += 1


Scene = Callable[[Stage, random.Random], Awaitable[None]]


async def turning(stage: Stage, rng: random.Random) -> None:
    """Another version becomes the newest, by a file that comes or goes."""
    path = stage.folder / f"reaching/{len(stage.contents)}.onnx"
    if path.exists():
        path.unlink()
    else:
        _put(path, stage.contents[0])
    await _settled(stage, lambda page: not page["reload"]["faults"])


async def replacing(stage: Stage, rng: random.Random) -> None:
    """Another content takes a file's place."""
    path = stage.folder / "plain.onnx"
    _put(path, next(c for c in stage.contents if c != path.read_bytes()))
    await _settled(stage, lambda page: not page["reload"]["faults"])


async def breaking_newest(stage: Stage, rng: random.Random) -> None:
    """A newer version that cannot be used comes, is told of, and goes."""
    path = stage.folder / "reaching/9.onnx"
    _put(path, rng.randbytes(50_000))
    await _settled(stage, lambda page: page["reload"]["faults"])
    path.unlink()
    await _settled(stage, lambda page: not page["reload"]["faults"])


async def breaking_in_place(stage: Stage, rng: random.Random) -> None:
    """A file is cut off where it lies; its place is taken by a whole one later."""
    path = stage.folder / "plain.onnx"
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    await _settled(stage, lambda page: page["reload"]["faults"])
    _put(path, content)
    await _settled(stage, lambda page: not page["reload"]["faults"])


async def killing(stage: Stage, rng: random.Random) -> None:
    """One worker dies; another takes its place."""
    worker = rng.choice(stage.workers())
    stage.book.killed.append(monotonic())
    os.kill(worker, signal.SIGKILL)

    def replaced() -> bool:
        return worker not in stage.workers() and stage.complete()

    await _until(stage, replaced, "a killed worker was not replaced")


async def restarting(stage: Stage, rng: random.Random) -> None:
    """SIGTERM in the middle, and a new start at the same port."""
    await stage.end()
    await stage.start()


MODEL_SCENES: tuple[Scene, ...] = (turning, replacing, breaking_newest, breaking_in_place)


def _put(path: Path, content: bytes) -> None:
    """Put a file in its place in one step."""
    aside = path.with_name(".aside")
    aside.write_bytes(content)
    aside.rename(path)


async def _settled(stage: Stage, is_so: Callable[[dict], object]) -> None:
    """Until the service says so, several times, for a worker each time."""
    async with httpx.AsyncClient(timeout=30) as client:
        settled, end = 0, monotonic() + 30

        while settled < 2 * WORKERS:
            if monotonic() > end:
                stage.book.fault("what lies in the folder was not noticed within 30 s")
                return
            try:
                page = await client.get(
                    f"http://127.0.0.1:{stage.port}/readyz", headers={"Connection": "close"}
                )
            except httpx.TransportError:
                continue
            settled = settled + 1 if page.status_code == 200 and is_so(page.json()) else 0
            await asyncio.sleep(0.1)


async def _until(stage: Stage, is_so: Callable[[], bool], fault: str) -> None:
    end = monotonic() + 30
    while not is_so():
        if monotonic() > end:
            stage.book.fault(f"{fault} within 30 s")
            return
        await asyncio.sleep(0.1)
