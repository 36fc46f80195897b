"""Build of the Dockerfile's image on a machine without a container engine.

buildah builds it unchanged; a base image of Debian's packages replaces the one in the registry.
"""

import json
import os
import subprocess
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import environment

TOOLS = {"buildah": "buildah", "mmdebstrap": "mmdebstrap"}
ROOTFS = environment.ROOT / "build/image/rootfs.tar"
PACKAGES = "ca-certificates,python3.11,python3.11-venv,python3-pip,python-is-python3"
BASE = "localhost/posefield-base:interop"
NAME, SOURCE, REVISION = "posefield:interop", "https://example.org/posefield", "0" * 40
# Where the machine trusts another certificate authority, or takes packages from elsewhere.
LENT = ("/etc/ssl/certs/ca-certificates.crt", "/etc/pip.conf")

# What a container runtime does: a root that cannot be written, a first process of somebody who may
# do nothing. $1: the root, $2: models, $3: /tmp, $4: user and group; then the command.
JAIL = """
set -e
mount --make-rprivate /
mount --bind "$1" "$1"
mount -t proc proc "$1/proc"
mount --bind /dev "$1/dev"
mount --bind "$2" "$1/models"
mount --bind "$3" "$1/tmp"
mount -o remount,bind,ro "$1/models"
mount -o remount,bind,ro "$1"
root=$1 user=$4
shift 4
exec setpriv --no-new-privs chroot --userspec="$user" "$root" "$@"
"""


@dataclass(frozen=True)
class Image:
    """A built image, laid open at `root`: config as Docker's inspect shows it, own: bytes of what
    the Dockerfile adds to its base, base: bytes of that."""

    root: Path
    config: dict[str, Any]
    own: int
    base: int

    def start(
        self, command: Sequence[str], models: Path, temporary: Path, **environ: str
    ) -> subprocess.Popen[bytes]:
        """The command in a container, on the machine's network."""
        given = dict(line.split("=", 1) for line in self.config["Env"]) | environ
        jail = ("unshare", "--mount", "--pid", "--fork", "--kill-child", "sh", "-c", JAIL, "jail")
        places = (self.root, models, temporary, self.config["User"])
        pipe = subprocess.PIPE
        # The jail is built with the programs of this machine.
        words = [
            "env",
            f"PATH={os.environ['PATH']}",
            *jail,
            *places,
            "env",
            f"PATH={given['PATH']}",
        ]
        return subprocess.Popen([*words, *command], env=given, stdout=pipe, stderr=pipe)


@contextmanager
def built() -> Iterator[Image]:
    """The image, in a container of its own that is thrown away afterwards."""
    _base()
    lent = [word for path in LENT if Path(path).exists() for word in ("-v", f"{path}:{path}:ro")]
    told = ["--build-arg", f"SOURCE={SOURCE}", "--build-arg", f"REVISION={REVISION}"]
    # Docker's format: the other one knows no HEALTHCHECK.
    told += ["--build-arg", f"BASE={BASE}"]
    _build("--format", "docker", "--network", "host", *lent, *told, "-t", NAME, environment.ROOT)
    container = _buildah("from", "--pull-never", NAME)
    try:
        root = Path(_buildah("mount", container))
        (root / "models").mkdir()
        of_base = _layers(BASE)
        own = sum(_layers(NAME)) - sum(of_base)
        yield Image(root, _inspected(NAME)["Docker"]["config"], own, sum(of_base))
    finally:
        _buildah("rm", container)


def _base() -> None:
    if not ROOTFS.exists():
        ROOTFS.parent.mkdir(parents=True, exist_ok=True)
        aside = ROOTFS.with_suffix(".part.tar")
        # pip installs where Debian would have only apt do so, as in the base itself.
        freed = 'rm "$1"/usr/lib/python3.11/EXTERNALLY-MANAGED'
        options = ("--variant=minbase", f"--include={PACKAGES}", f"--customize-hook={freed}")
        _run("mmdebstrap", "--quiet", *options, "bookworm", aside)
        aside.rename(ROOTFS)
    if subprocess.run(["buildah", "inspect", BASE], capture_output=True).returncode:
        recipe = ROOTFS.with_name("base.Dockerfile")
        recipe.write_text(f"FROM scratch\nADD {ROOTFS.name} /\n")
        _build("-f", recipe, "-t", BASE, ROOTFS.parent)


def _build(*words: str | Path) -> None:
    _buildah("bud", "--layers", "--pull-never", "--isolation", "chroot", *words)


def _inspected(name: str) -> dict[str, Any]:
    return json.loads(_buildah("inspect", "--type", "image", name))  # type: ignore[no-any-return]


def _layers(name: str) -> list[int]:
    """Bytes of each layer, unpacked."""
    manifest = json.loads(_inspected(name)["Manifest"])
    return [layer["size"] for layer in manifest["layers"]]


def _buildah(*words: str | Path) -> str:
    return _run("buildah", *words)


def _run(*words: str | Path) -> str:
    done = subprocess.run(words, capture_output=True, text=True)
    if done.returncode:
        said = f"{done.stdout[-2000:]}\n{done.stderr[-2000:]}"
        raise RuntimeError(f"{' '.join(map(str, words[:2]))} failed:\n{said}")
    return done.stdout.strip()
