"""nginx with the shipped configuration, with changed addresses and folders."""

import os
import subprocess
from collections.abc import Callable, Mapping
from pathlib import Path

import debian
import environment

CONF = environment.ROOT / "service/deploy/nginx.conf"


def missing() -> str:
    """Return why nginx cannot be run; empty where it can."""
    return debian.missing({"nginx": "nginx-light"})


def command(folder: Path, text: str, service: int, port: int) -> list[str | Path]:
    """Return the command of an nginx with this configuration, which nginx has checked.

    folder: where its files go. service, port: ports of the service and of nginx on this machine.
    """
    places = {
        "127.0.0.1:8000": f"127.0.0.1:{service}",
        "listen 8080": f"listen 127.0.0.1:{port}",
        "/var/cache/nginx/posefield": str(folder / "cache"),
    }
    for usual, here in places.items():
        text = replaced(text, usual, here)
    folders = "".join(
        f"{kind}_temp_path {folder / kind};\n"
        for kind in ("client_body", "proxy", "fastcgi", "uwsgi", "scgi")
    )
    user = "user root;\n" if os.geteuid() == 0 else ""
    whole = (
        f"{user}daemon off;\npid {folder / 'nginx.pid'};\nerror_log stderr;\nevents {{}}\n"
        f"http {{\naccess_log off;\n{folders}{text}}}\n"
    )
    path = folder / "nginx.conf"
    path.write_text(whole)
    subprocess.run(["nginx", "-t", "-q", "-c", path], check=True)
    return ["nginx", "-c", path]


def replaced(text: str, part: str, other: str) -> str:
    """Return the text with another part in place of one that occurs exactly once."""
    assert text.count(part) == 1, part
    return text.replace(part, other)


def configuration_faults(
    subject: str,
    text: str,
    needed: Mapping[str, tuple[str, str]],
    faults: Callable[[str], list[str]],
) -> list[str]:
    """Return the faults of a configuration, and each needed line that can be spoiled unnoticed.

    needed: by line of the configuration, what spoils it and how the fault that it causes begins.
    """
    if reason := missing():
        print(f"no proxy before the service: {reason}")
        return []
    spoiled = text
    for line, (other, _) in needed.items():
        spoiled = spoiled.replace(line, other)
    found, noticed = faults(text), faults(spoiled)
    for line, (_, fault) in needed.items():
        if line not in text or not any(each.startswith(fault) for each in noticed):
            found.append(f"nothing is noticed without {line!r}")
    return [f"{subject}: {fault}" for fault in found]
