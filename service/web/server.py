"""The process: load the models, listen, answer until told to end."""

import logging
import os
import socket
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import uvicorn

from service.synthesis.library import Bounds
from service.synthesis.shelf import Shelf
from service.web import listening, log, metrics, patience, protocol, tracing, workers
from service.web.app import create_app
from service.web.draining import Ending, Server
from service.web.readiness import Readiness
from service.web.settings import Settings
from service.web.telling import Telling
from service.web.workers import Hooks, Work


def serve(places: Sequence[str | Path], settings: Settings, hooks: Hooks | None = None) -> None:
    """Answer for the models of files, folders and URLs until SIGTERM or SIGINT, then return.

    hooks: what is to be done for each of several worker processes.
    Raises ModelError, before anything listens, for a file that cannot be served, InvalidField for
    an address that cannot be had, and WorkerDied where worker processes could not be kept alive.
    """
    sockets = listening.bound(settings.host, settings.port)
    where = listening.address(sockets)

    def listens(names: Sequence[str]) -> None:
        sys.stdout.write(f"posefield: {', '.join(names)} at {where}\n")
        sys.stdout.flush()

    work = Work(tuple(str(place) for place in places), settings, sockets)
    try:
        if (count := settings.workers or workers.processors()) > 1:
            with metrics.shared() as folder:
                own = Hooks(lambda number: {metrics.FOLDER: folder}, metrics.gone)
                workers.keep(count, work, listens, hooks or own)
        else:
            answer(work, listens)
    finally:
        listening.close(sockets)


def answer(
    work: Work, listens: Callable[[Sequence[str]], None], owner: socket.socket | None = None
) -> None:
    """Answer in this process until told to end; raises ModelError as `serve` does.

    listens: told the models' names once it does. owner: a socket whose end is a demand to end, too.
    """
    settings = work.settings
    shelf = Shelf(work.places, Bounds(settings.versions, settings.versions_memory))
    # Where nobody answers any more, half the models are better than none.
    if not (work.again and shelf.library.models):
        shelf.check()
    readiness = Readiness(shelf)
    lines = log.to_standard_error() if settings.log == "on" else None
    telling = Telling(lines, tracing.of())
    server = Server(
        _config(readiness, settings, telling),
        readiness,
        Ending(settings.drain, settings.grace),
        lambda: listens([*shelf.library.models]),
        owner,
    )
    with shelf.watched(settings.reload):
        server.run(work.sockets)
    telling.close()
    if server.cut_off:
        # A thread that is not done would hold the process up.
        logging.shutdown()
        sys.stdout.flush()
        os._exit(0)


def _config(readiness: Readiness, settings: Settings, telling: Telling) -> uvicorn.Config:
    return uvicorn.Config(
        create_app(readiness, settings, telling),
        # Named, not "auto": without them the service would run at a fraction of its speed.
        loop="uvloop",
        http=protocol.bounded(patience.of(settings)),
        # Who asks for whom is no concern of ours, and whom to believe is not known here.
        proxy_headers=False,
        ws="none",
        lifespan="off",
        log_level="warning",
        access_log=False,
        server_header=False,
    )
