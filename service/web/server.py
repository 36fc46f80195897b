"""The process: load the models, listen, answer until told to end."""

import signal
import socket
import sys
from collections.abc import Sequence
from pathlib import Path

import uvicorn

from service.synthesis import library
from service.web import patience, protocol
from service.web.app import create_app
from service.web.settings import Settings


def serve(paths: Sequence[Path], settings: Settings) -> None:
    """Answer for the models of files and folders until SIGTERM or SIGINT, then return.

    Raises ModelError, before anything listens, for a file that cannot be served.
    """
    loaded = library.load(paths)
    config = uvicorn.Config(
        create_app(loaded, settings),
        host=settings.host,
        port=settings.port,
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
        timeout_graceful_shutdown=settings.grace,
    )
    # uvicorn raises the signal that ended it once more; here an end on demand is a success.
    for ending in (signal.SIGTERM, signal.SIGINT):
        signal.signal(ending, lambda *_: None)
    _Server(config, list(loaded.models)).run()


class _Server(uvicorn.Server):
    """A server that says where it listens, in one line, once it does."""

    def __init__(self, config: uvicorn.Config, models: Sequence[str]) -> None:
        super().__init__(config)
        self.models = models

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Listen, then say so."""
        await super().startup(sockets)
        host, port = self.servers[0].sockets[0].getsockname()[:2]
        shown = f"[{host}]" if ":" in host else host
        sys.stdout.write(f"posefield: {', '.join(self.models)} at http://{shown}:{port}\n")
        sys.stdout.flush()
