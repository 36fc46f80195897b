"""One of several processes that answer; service.web.workers starts it and keeps it alive."""

import pickle
import socket
import sys
from collections.abc import Sequence

from service.web import server
from service.web.workers import Work


def main() -> None:
    """Answer on the sockets, and tell the first one, whose end is a demand to end, how it goes."""
    channel, *sockets = (socket.socket(fileno=int(word)) for word in sys.argv[1:])
    with channel.makefile("rb") as reader:
        places, settings, again = pickle.load(reader)

    def listens(names: Sequence[str]) -> None:
        channel.sendall(pickle.dumps(list(names)))

    try:
        server.answer(Work(places, settings, sockets, again), listens, channel)
    except Exception as fault:
        channel.sendall(pickle.dumps(fault))
        sys.exit(1)


if __name__ == "__main__":
    main()
