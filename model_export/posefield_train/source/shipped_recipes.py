"""Recipes and tables of clips of the package, by name; their owners publish the motion data."""

from pathlib import Path

from posefield.common.errors import InvalidField, RecipeError
from posefield.common.name_suggestion import did_you_mean
from posefield_train.source import data_folder
from posefield_train.source.data_folder import FileLocation

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
        found = f"{given.name!r}{did_you_mean(given.name, known)}"
        raise InvalidField("RECIPE", f"{found}, expected a TOML file or one of {shipped}")
    if data is None:
        raise InvalidField("data", f"missing, expected the folder of the data of {given.name}")
    return FOLDER / f"{given.name}.toml"


def find_table(folder: Path, name: str, beside: Path | None = None) -> FileLocation:
    """Return the table of clips in a data folder, else beside the recipe, else the shipped one.

    beside: folder of the recipe. Raises RecipeError, as `data_folder.find`, if none exists.
    """
    try:
        return data_folder.find(folder, name)
    except RecipeError:
        if beside is not None and ".." not in Path(name).parts and (beside / name).is_file():
            return beside / name
        shipped = {path.relative_to(FOLDER).as_posix(): path for path in FOLDER.glob("*/*.csv")}
        if name not in shipped:
            raise
        return shipped[name]


def table_notes(place: str) -> list[str]:
    """Return a note on the use of a shipped table; none for a table of the data folder."""
    if not Path(place).is_relative_to(FOLDER):
        return []
    name = Path(place).relative_to(FOLDER).as_posix()
    return [f"{name}: the data folder has no such table, the one that ships was used"]
