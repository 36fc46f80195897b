"""Installation of missing Debian packages for the checks."""

import os
import shutil
import subprocess


def missing(programs: dict[str, str]) -> str:
    """Why some of the programs (name: package) cannot be had; empty where all are there."""
    wanted = [package for name, package in programs.items() if not shutil.which(name)]
    if not wanted:
        return ""
    if os.geteuid() or not shutil.which("apt-get"):
        return f"needs {' '.join(wanted)} (Debian's names), and there is no root or no apt-get"
    quiet = ("apt-get", "-qq")
    for words in (("update",), ("install", "--yes", "--no-install-recommends", *wanted)):
        done = subprocess.run([*quiet, *words], capture_output=True, text=True)
        if done.returncode:
            return f"apt-get {words[0]}: {done.stderr.strip() or done.stdout.strip()}"
    return ""
