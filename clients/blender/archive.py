"""Build the add-on's archive for Blender: python clients/blender/archive.py FOLDER.

Equal files give equal bytes.
"""

import sys
import tomllib
import zipfile
from pathlib import Path

ADDON = Path(__file__).with_name("addon")
LICENCE = Path(__file__).parents[2] / "LICENSE"

# Earliest time of a zip archive, so that the bytes depend on the files alone.
TIME = (1980, 1, 1, 0, 0, 0)
READABLE = 0o644 << 16


def build(folder: Path) -> Path:
    """Build posefield-blender-VERSION.zip in a folder and return its path."""
    manifest = tomllib.loads((ADDON / "blender_manifest.toml").read_text())
    made = folder / f"posefield-blender-{manifest['version']}.zip"
    folder.mkdir(parents=True, exist_ok=True)
    with zipfile.ZipFile(made, "w") as archive:
        for name, file in sorted(files().items()):
            member = zipfile.ZipInfo(name, TIME)
            member.create_system, member.external_attr = 3, READABLE
            member.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(member, file.read_bytes())
    return made


def files() -> dict[str, Path]:
    """Return the archive's files by their names in it."""
    code = (*ADDON.rglob("*.py"), ADDON / "blender_manifest.toml")
    return {"LICENSE": LICENCE} | {file.relative_to(ADDON).as_posix(): file for file in code}


if __name__ == "__main__":
    print(build(Path(sys.argv[1])))
