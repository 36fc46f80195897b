"""State since the last refresh, of the running Blender, not of its files."""

from dataclasses import dataclass, field

from .without_blender.card import Card


@dataclass
class State:
    """State of the add-on.

    models: name and description of each. card: of the picked model. said: messages in the panel.
    failed: True if they report an error. taking: a card is being
    taken, so that changes of settings ask nothing.
    """

    models: tuple[tuple[str, str], ...] = ()
    card: Card | None = None
    said: list[str] = field(default_factory=list)
    failed: bool = False
    taking: bool = False

    def tell(self, *sentences: str, failed: bool = False) -> None:
        """Replace the messages."""
        self.said, self.failed = [each for each in sentences if each], failed


current = State()
