"""State since the last refresh, of the running Blender, not of its files."""

from dataclasses import dataclass, field

from .without_blender.cards import Card
from .without_blender.clips import Clip


@dataclass
class Session:
    """State of the add-on.

    models: name and description of each. card: of the picked model. clip: last imported clip. said:
    messages in the panel. failed: True if they report an error.
    """

    models: tuple[tuple[str, str], ...] = ()
    card: Card | None = None
    clip: Clip | None = None
    said: list[str] = field(default_factory=list)
    failed: bool = False

    def tell(self, *sentences: str, failed: bool = False) -> None:
        """Replace the messages."""
        self.said, self.failed = [each for each in sentences if each], failed


current = Session()

FINISHED, CANCELLED = {"FINISHED"}, {"CANCELLED"}


def ended(operator, sentences, level="INFO"):
    """Report an operator's sentences, show them in the panel, and return its outcome.

    level: of the report; "ERROR" for an operator that has changed nothing.
    """
    current.tell(*sentences, failed=level == "ERROR")
    for sentence in sentences:
        operator.report({level}, sentence)
    return CANCELLED if level == "ERROR" else FINISHED


def forget() -> None:
    """Clear the state."""
    current.models, current.card, current.clip = (), None, None
    current.tell()
