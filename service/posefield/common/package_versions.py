"""Versions of installed packages on which results depend."""

from importlib.metadata import PackageNotFoundError, version

SAME_MODULE = {"onnxruntime": "onnxruntime-gpu"}
"""Packages that have the same module as another, and are installed in its place."""


def package_version(name: str) -> str:
    """Return the version of a package, or of the one in its place.

    Raises PackageNotFoundError if neither is installed.
    """
    try:
        return version(name)
    except PackageNotFoundError:
        if name not in SAME_MODULE:
            raise
        return version(SAME_MODULE[name])
