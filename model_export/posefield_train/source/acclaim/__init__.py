"""Acclaim motion files: a skeleton (ASF), motions of it (AMC), and their conversion to a clip."""

from posefield_train.source.acclaim.acclaim_conversion import to_clip
from posefield_train.source.acclaim.acclaim_text import FileLike
from posefield_train.source.acclaim.amc_reader import AmcFile, read_amc
from posefield_train.source.acclaim.asf_reader import AsfBone, AsfFile, read_asf

__all__ = ["AmcFile", "AsfBone", "AsfFile", "FileLike", "read_amc", "read_asf", "to_clip"]
