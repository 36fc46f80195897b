"""Training of motion models: `read_recipe`, `train` from a folder of clips, `export` to a file."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from posefield_train.training import export as export
    from posefield_train.training import read_recipe as read_recipe
    from posefield_train.training import train as train

__all__ = ["export", "read_recipe", "train"]


def __getattr__(name: str) -> Any:
    # SciPy and onnx take a second to import: at the first use, not by `import posefield_train`.
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from posefield_train import training

    return getattr(training, name)
