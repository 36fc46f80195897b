"""USD files with a skeleton of UsdSkel and its animation."""

from posefield_train.source.usd_skel.skel_stage import read

__all__ = ["read"]
