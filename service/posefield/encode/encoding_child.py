"""Process that encodes one crowd.

`python -m posefield.encode.encoding_child PATH INSTANCING BODY` reads pickles from
standard input: the crowd without motions, batches of them, and None. It writes the file PATH.
`crowd_writer.stream_from_child` starts it.
"""

import pickle
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import IO, cast

from posefield.encode import crowd_writer
from posefield.motion.clip import Motions
from posefield.question.motion_question import BodyKind


def main() -> None:
    """Encode the crowd of standard input.

    Raises EOFError if the input ends early.
    """
    path, instancing = Path(sys.argv[1]), sys.argv[2]
    body = cast(BodyKind, sys.argv[3])
    stdin = sys.stdin.buffer
    crowd = replace(pickle.load(stdin), batches=_received_batches(stdin))
    with path.open("wb") as file:
        file.writelines(crowd_writer.encode_here(crowd, path.suffix[1:], instancing, body))


def _received_batches(stream: IO[bytes]) -> Iterator[Motions]:
    while (batch := pickle.load(stream)) is not None:
        yield batch


if __name__ == "__main__":
    main()
