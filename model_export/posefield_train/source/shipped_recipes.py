"""Recipes of the package, by name: their motion data is published by its owners."""

from pathlib import Path

from posefield.common.errors import InvalidField

FOLDER = Path(__file__).parents[1] / "recipes"


def names() -> list[str]:
    """Return the names of the recipes."""
    return sorted(path.stem for path in FOLDER.glob("*.toml"))


def file_of(given: Path, data: Path | None) -> Path:
    """Return the recipe file of a command's argument: a path, or the name of a shipped recipe.

    data: folder of the motion data, which a shipped recipe needs. Raises InvalidField for an
    unknown name and for a shipped recipe without data.
    """
    if given.suffix or len(given.parts) > 1 or given.exists():
        return given
    if given.name not in (known := names()):
        shipped = ", ".join(known)
        raise InvalidField("RECIPE", f"{given.name!r}, expected a TOML file or one of {shipped}")
    if data is None:
        raise InvalidField("data", f"missing, expected the folder of the data of {given.name}")
    return FOLDER / f"{given.name}.toml"
