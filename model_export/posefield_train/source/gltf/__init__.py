"""glTF 2.0 files (GLB and glTF): skins or animated nodes as joints, and one animation of them."""

from posefield_train.source.gltf.gltf_motion import read

__all__ = ["read"]
