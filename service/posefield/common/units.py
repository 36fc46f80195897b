"""Units, axes and array types of the whole project.

Lengths are metres, times seconds, angles radians. Y is up, the frame is right-handed, a character
that faces straight ahead faces +Z. Quaternions are unit, in the order w x y z, and local to the
parent joint. Array axes run (..., frames, joints, component); leading axes are free. Other units
exist only where a file or a wire format is read or written, and the functions there have no default
for them.

Shapes of arrays in signatures, in the language of jaxtyping.

`Annotated[Floats, "frames joints 3"]` names the axes of an array. A name has one size within a
call, and within the fields of a dataclass. `*poses` stands for any number of axes, `*#poses` for
axes that broadcast against each other, `...` for any axes. Nothing reads the shapes at run time:
the tests check them (tests/shape_checks.py).

Axes of several modules, with the letters of the docstrings. Motions: frames (F; canonical ones T;
asked ones S), joints (J), poses (P), clips, characters or motions (N, M), strides, levels of detail
(L), labels (p, of all label sets) and combinations of them, feet (K), knots of a warp, features of
a trace, waves of a sum; chosen ones of them. Walks: waypoints, paths, exits and entries of a cut,
seeds, samples and directions of variables.
Kriging: points (B; a and b where there are two kinds), samples (n), their coordinates (d + p),
controls (d), functions of a drift (k), rows of the system (n + k), linear functions (p + 1 + d),
values (m), inducing clips. Tensors: dof of a pose (D), those varying (D'), freedoms (r1), times
(r2) and modes (r3) of a reduced tensor, more_times and more_modes of one with the event's blend,
rank of another decomposition, reduced motions (r2 r1), variables of a correction. Faces: curves
(C). Feet: rows (R) of feet with their runs and stances, foot_frames and all_frames of all of them,
grid of a plan, chains of frames (chain_frames) of paths, systems of blocks, owners of bones.
Any: batch, some, rows, columns, numbers, pairs, size.
"""

from typing import Annotated, Literal

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
"""Arrays of numbers; float64 except for the poses that a model returns."""

Singles = npt.NDArray[np.float32]
"""Poses as a model returns them: float64 would double their memory."""

Indices = npt.NDArray[np.int64]

Booleans = npt.NDArray[np.bool_]

LengthUnit = Literal["m", "cm"]
"""Unit of length of a file."""

UpAxis = Literal["y", "z"]
"""Up axis of a file."""

UP = np.array([0.0, 1.0, 0.0])

MICROMETRES = 6
"""Decimals of metres to which numbers of answers are rounded, and distances compared, so that
machines whose last digits differ agree."""


# Of any number of rotations and vectors, which broadcast.
Scalars = Annotated[Floats, "*#batch"]
Vectors = Annotated[Floats, "*#batch 3"]
Quaternions = Annotated[Floats, "*#batch 4"]

# Of one motion, of its skeleton, and of motions with any axes before.
Vector = Annotated[Floats, "3"]
Bones = Annotated[Floats, "joints 3"]
JointWeights = Annotated[Floats, "joints"]
Frames = Annotated[Floats, "frames"]
JointRotations = Annotated[Floats, "joints 4"]
RootPath = Annotated[Floats, "frames 3"]
Rotations = Annotated[Floats, "frames joints 4"]
Positions = Annotated[Floats, "frames joints 3"]

# Of clips of one length.
PerClip = Annotated[Floats, "clips"]
ClipBones = Annotated[Floats, "clips joints 3"]
ClipTravel = Annotated[Floats, "clips 3"]
ClipFrames = Annotated[Floats, "clips frames"]
ClipPaths = Annotated[Floats, "clips frames 3"]
ClipRotations = Annotated[Floats, "clips frames joints 4"]
ClipPositions = Annotated[Floats, "clips frames joints 3"]
PoseVectors = Annotated[Floats, "clips frames dof"]
Traces = Annotated[Floats, "clips frames features"]

# Of walking crowds.
PerCharacter = Annotated[Floats, "characters"]
CharacterFrames = Annotated[Floats, "characters frames"]
CharacterPoints = Annotated[Floats, "characters points"]

# Of kriging.
PerControl = Annotated[Floats, "controls"]
PerSample = Annotated[Floats, "samples"]
PerPoint = Annotated[Floats, "points"]
Points = Annotated[Floats, "points coordinates"]
Samples = Annotated[Floats, "samples coordinates"]
PointControls = Annotated[Floats, "points controls"]
SampleControls = Annotated[Floats, "samples controls"]
PointLabels = Annotated[Floats, "points labels"]
PointSamples = Annotated[Floats, "points samples"]
SampleMatrix = Annotated[Floats, "samples samples"]
PointValues = Annotated[Floats, "points values"]
SampleValues = Annotated[Floats, "samples values"]

# Of corrections.
Variables = Annotated[Floats, "variables"]
Values = Annotated[Floats, "values"]
Gradients = Annotated[Floats, "values variables"]
ReducedMotions = Annotated[Floats, "motions reduced"]
