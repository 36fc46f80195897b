"""Options for the character of a user, which commands that write motions share."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from posefield.common.errors import InvalidField
from posefield.encode.formats import ClipEncoder
from posefield.question.motion_question import FileQuestion
from posefield.question.performance_question import PerformanceQuestion

if TYPE_CHECKING:
    from posefield.characters.delivery import Delivery
    from posefield.characters.user_character import UserCharacter


@dataclass(frozen=True)
class CharacterOptions:
    """Character to which motions are delivered, and the roles of its joints."""

    character: Annotated[
        Path | None,
        typer.Option(
            help="USD or .glb file of a character that moves instead of the model's own",
            metavar="FILE",
        ),
    ] = None
    roles: Annotated[
        Path | None,
        typer.Option(
            help="TOML file with a table of roles, for joints of --character whose names do not "
            "tell them",
            metavar="FILE",
        ),
    ] = None

    def open(self, folder: Path) -> "UserCharacter | None":
        """Return the character to which files in a folder refer; None without one.

        Raises InvalidField for roles without a character, FileError for files that cannot be read.
        """
        if self.character is None:
            if self.roles is not None:
                raise InvalidField("roles", f"{self.roles} without --character, expected with it")
            return None
        # usd-core takes 0.12 CPU seconds to import.
        from posefield.characters import user_character

        reference = user_character.relative_reference(self.character, folder)
        roles = {} if self.roles is None else user_character.read_roles(self.roles)
        return user_character.open_character(self.character, reference, roles)

    def delivery(
        self, form: ClipEncoder, asked: FileQuestion | PerformanceQuestion, output: Path
    ) -> "Delivery | None":
        """Return the delivery of answers to a file; None without a character.

        Raises as `open`, and InvalidField for what the file of a character cannot hold.
        """
        opened = self.open(output.absolute().parent)
        if opened is None:
            return None
        from posefield.characters import delivery

        return delivery.deliver(opened, form, asked)

    def refuse(self, reason: str) -> None:
        """Raise InvalidField with a reason if a character or roles are given."""
        for option in ("character", "roles"):
            if getattr(self, option) is not None:
                raise InvalidField(option, f"given {reason}")
