"""Clips of an export for the character of a user: its delivery, and what is refused."""

from typing import TYPE_CHECKING

from posefield.batch import layouts
from posefield.batch.job import WorkerInput
from posefield.batch.rows import ClipQuery
from posefield.common.errors import InvalidField
from posefield.encode.formats import CLIP_ENCODERS
from posefield.model_file.model_card import ModelCard

if TYPE_CHECKING:
    from posefield.characters.delivery import Delivery

LAYOUT = "folder"
"""Layout whose files refer to the file of a character."""
FOLDER = layouts.path(0, "", "").rpartition("/")[0]
"""Folder of the first clips in a target; those of all clips are as deep."""


def check_layout(layout: str) -> None:
    """Raise InvalidField for a layout other than loose files.

    Those of an archive would refer to the character from wherever they are unpacked, and a library
    has the character of its model.
    """
    if layout != LAYOUT:
        raise InvalidField(
            "layout", f"{layout!r} with a character, expected {LAYOUT!r}: files refer to its file"
        )


def check_model(card: ModelCard) -> None:
    """Raise InvalidField for a model whose clips cannot be retargeted."""
    # Modules that only exports for a character need.
    from posefield.retarget import role_map

    role_map.body_of_motion(card.skeleton, card.skeleton.offsets, card.roles)


def delivery_of(work: WorkerInput, extension: str) -> "Delivery | None":
    """Return the delivery to the character of an export in a format; None without a character.

    Raises InvalidField for what files of the format cannot hold.
    """
    if work.character is None:
        return None
    # Modules that only exports for a character need.
    from posefield.characters import delivery

    return delivery.deliver(work.character, CLIP_ENCODERS[extension], work.job)


def misfit(work: WorkerInput, query: ClipQuery) -> str | None:
    """Return why the clip of a query cannot be delivered to the character; None if it can."""
    try:
        order = delivery_of(work, query.format)
        if order is not None:
            order.character.target.check(query.question)
    except InvalidField as fault:
        return str(fault)
    return None
