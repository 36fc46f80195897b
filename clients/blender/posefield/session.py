"""What is known since the last refresh. It belongs to the running Blender and not to its files."""

from dataclasses import dataclass, field

from .without_blender.cards import Card
from .without_blender.clips import Clip


@dataclass
class Session:
    """models: name and description of each. card: of the model that was picked. said: what the
    panel shows, and whether it is a fault."""

    models: tuple[tuple[str, str], ...] = ()
    card: Card | None = None
    clip: Clip | None = None
    said: list[str] = field(default_factory=list)
    failed: bool = False

    def tell(self, *sentences: str, failed: bool = False) -> None:
        """Show sentences in place of those before."""
        self.said, self.failed = [each for each in sentences if each], failed


current = Session()


def forget() -> None:
    """Know nothing any more."""
    current.models, current.card, current.clip = (), None, None
    current.tell()
