"""Client of a posefield service: poses as NumPy arrays, motions and crowds as files or tables.

    from posefield_client import Client

    with Client("http://localhost:8000") as client:
        client.model("walk").clip(speed=1.4).save("clip.usdc")

Metres, seconds, Y up; quaternions are unit, w x y z, local to the parent. posefield_client.errors
lists the exceptions.
"""

from posefield_client import errors
from posefield_client.aio import (
    AsyncClient,
    AsyncClip,
    AsyncCrowd,
    AsyncModel,
    AsyncPerformance,
    AsyncSaving,
)
from posefield_client.cache import NOTHING, Cache, Memory
from posefield_client.client import Client, Clip, Crowd, Model, Performance, Saving
from posefield_client.disk import Disk
from posefield_client.errors import PosefieldError
from posefield_client.generated import (
    CONTRACT,
    Camera,
    Control,
    Floor,
    ManifestEntry,
    Met,
    ModelCard,
    NamedClipQuestion,
    NamedScript,
    PerformanceEntry,
    PerformanceQuestion,
    PerformanceReport,
    Reasons,
    Suggestions,
    Target,
    Trust,
)
from posefield_client.numbers import ClipNumbers, CrowdPoses, PerformanceNumbers, Pose, SigmaGrid
from posefield_client.retry import NEVER, Retry
from posefield_client.saving import Missed, Progress, Saved
from posefield_client.scripts import Script

__all__ = [
    "CONTRACT",
    "NEVER",
    "NOTHING",
    "AsyncClient",
    "AsyncClip",
    "AsyncCrowd",
    "AsyncModel",
    "AsyncPerformance",
    "AsyncSaving",
    "Cache",
    "Camera",
    "Client",
    "Clip",
    "ClipNumbers",
    "Control",
    "Crowd",
    "CrowdPoses",
    "Disk",
    "Floor",
    "ManifestEntry",
    "Memory",
    "Met",
    "Missed",
    "Model",
    "ModelCard",
    "NamedClipQuestion",
    "NamedScript",
    "Performance",
    "PerformanceEntry",
    "PerformanceNumbers",
    "PerformanceQuestion",
    "PerformanceReport",
    "Pose",
    "PosefieldError",
    "Progress",
    "Reasons",
    "Retry",
    "Saved",
    "Saving",
    "Script",
    "SigmaGrid",
    "Suggestions",
    "Target",
    "Trust",
    "errors",
]
