"""Kriging parameters with one label set, for tests."""

from dataclasses import replace

from posefield.kriging.kriging_model import LabelKernel


def performers(count, correlation, offset):
    """Return the kernels of one label set."""
    return (LabelKernel(count, correlation, offset),)


def vary(hyper, **changes):
    """Return parameters with others, the correlation and offset of the only label set included."""
    (kernel,) = hyper.labels
    own = {name: changes.pop(name) for name in ("correlation", "offset") if name in changes}
    return replace(hyper, **changes, labels=(replace(kernel, **own),))
