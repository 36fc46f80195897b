"""Crowds as USD, to a file or to a stream.

Characters share data in one of three ways, for different readers:

references  every character refers to one prototype; the only form of sharing that is animated
            both by Blender's default import and by pxr.
scenegraph  the same, instanceable: fastest to draw and to open. Blender's default import shows it
            as one character frozen in its rest pose.
flatten     all data are copied into one layer, for readers without composition.
"""

INSTANCING = ("references", "scenegraph", "flatten")
FILES, STREAMS = ("usd", "usda", "usdc", "usdz"), ("usda", "usdc", "usdz")
"""Extensions of crowds on disk, and of those that are a single file and can be streamed."""
