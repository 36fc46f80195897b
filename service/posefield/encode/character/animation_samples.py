"""Motions in USD's form: float32, real part last, neighbouring quaternions of one sign."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from posefield.common.units import Floats, Indices, Singles
from posefield.motion.clip import Clip, Motions


@dataclass(frozen=True)
class AnimationSamples:
    """M motions of one skeleton, concatenated: motion m has the frames starts[m] to starts[m + 1].

    rotations (N, J, 4): of all frames, real part last. path (N, 3): root positions, m. offsets (M,
    J, 3): of the bones, m; the root's is not used. starts: (M + 1,). hips (N, 3): translations of
    joint 1 below a root bone, m; None where there is none. No number is -0.
    """

    rotations: Singles
    path: Singles
    offsets: Singles
    starts: Indices
    hips: Singles | None = None

    def __len__(self) -> int:
        return len(self.offsets)

    @cached_property
    def translations(self) -> Singles:
        """Return the local translations (N, J, 3), m."""
        local = np.repeat(self.offsets, np.diff(self.starts), axis=0)
        local[:, 0] = self.path
        if self.hips is not None:
            local[:, 1] = self.hips
        return local

    def parts(self, frames: int) -> Iterator["AnimationSamples"]:
        """Yield the motions in parts of at most `frames` frames, longer motions one by one."""
        first = 0
        while first < len(self):
            last = int(np.searchsorted(self.starts, self.starts[first] + frames, "right")) - 1
            last = max(last, first + 1)
            yield self._between(first, last)
            first = last

    def _between(self, first: int, last: int) -> "AnimationSamples":
        frames = slice(self.starts[first], self.starts[last])
        starts = self.starts[first : last + 1] - self.starts[first]
        offsets = self.offsets[first:last]
        hips = None if self.hips is None else self.hips[frames]
        return AnimationSamples(self.rotations[frames], self.path[frames], offsets, starts, hips)


def from_clips(clips: Sequence[Clip], root_bone: bool = False) -> AnimationSamples:
    """Return the moves of clips of one skeleton, with the bone offsets of their first frames."""
    starts = _starts([len(clip) for clip in clips])
    samples = _empty(starts, len(clips[0].skeleton))
    for index, clip in enumerate(clips):
        frames = slice(starts[index], starts[index + 1])
        _write_real_part_last(clip.rotations, samples.rotations[frames])
        samples.path[frames] = clip.translations[:, 0]
        samples.offsets[index] = clip.translations[0]
    if root_bone:
        samples = replace(
            samples, hips=np.concatenate([c.translations[:, 1] for c in clips], dtype="f4")
        )
    return _normalize(samples)


def from_motions(batch: Motions) -> AnimationSamples:
    """Return the moves of a crowd's motions."""
    count, frames, joints = batch.rotations.shape[:3]
    samples = _empty(_starts([frames] * count), joints)
    _write_real_part_last(batch.rotations.reshape(-1, joints, 4), samples.rotations)
    samples.path[:] = batch.root_position.reshape(-1, 3)
    samples.offsets[:] = batch.bone_offsets
    return _normalize(samples)


def _starts(frames: Sequence[int]) -> Indices:
    return np.concatenate([[0], np.cumsum(frames)])


def _empty(starts: Indices, joints: int) -> AnimationSamples:
    motions, frames = len(starts) - 1, int(starts[-1])
    rotations = np.empty((frames, joints, 4), np.float32)
    path, offsets = np.empty((frames, 3), np.float32), np.empty((motions, joints, 3), np.float32)
    return AnimationSamples(rotations, path, offsets, starts)


def _write_real_part_last(wxyz: Floats | Singles, xyzw: Singles) -> None:
    """Write quaternions with the real part last.

    All numbers move by one in a single copy, then the real parts are set.
    """
    source, target = np.ascontiguousarray(wxyz).reshape(-1), xyzw.reshape(-1)
    target[:-1] = source[1:]
    target[3::4] = source[::4]


def _normalize(samples: AnimationSamples) -> AnimationSamples:
    _unroll_quaternions(samples)
    for values in (samples.rotations, samples.path, samples.offsets, samples.hips):
        if values is not None:
            # USD's deduplication does not distinguish -0 from 0.
            values += np.float32(0.0)
    return samples


def _unroll_quaternions(samples: AnimationSamples) -> None:
    """Choose signs so that neighbours lie close: some readers interpolate by component."""
    products = samples.rotations[1:] * samples.rotations[:-1]
    dots = products[..., 0] + products[..., 1] + products[..., 2] + products[..., 3]
    dots[samples.starts[1:-1] - 1] = 1.0
    if not len(dots) or dots.min() >= 0:
        return
    signs = np.where(dots < 0, np.float32(-1.0), np.float32(1.0))
    for first, last in zip(samples.starts, samples.starts[1:], strict=False):
        turned = np.cumprod(signs[first : last - 1], axis=0, dtype=np.float32)
        samples.rotations[first + 1 : last] *= turned[..., None]
