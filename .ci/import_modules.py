"""Import every module of the installed packages; exit with 1 if there is none."""

import importlib
import importlib.util
import os
import pkgutil
import sys
import warnings

os.environ["ORT_DISABLE_TELEMETRY"] = "1"
warnings.simplefilter("error")

# Runs the command when imported.
SKIPPED = {"posefield.__main__"}
# Of libraries that are larger than all others together, and that nothing installs by itself.
for library in ("jax", "torch"):
    if importlib.util.find_spec(library) is None:
        SKIPPED.add(f"posefield.reference.{library}")

names = []
for root in ("posefield", "posefield_train", "posefield_client"):
    package = importlib.import_module(root)
    names += [m.name for m in pkgutil.walk_packages(package.__path__, f"{root}.")]
for name in sorted({*names} - SKIPPED):
    importlib.import_module(name)
print(f"{len(names)} modules imported by Python {sys.version.split()[0]}")
sys.exit(not names)
