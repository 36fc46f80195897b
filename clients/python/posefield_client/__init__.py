"""Client of a posefield service: poses as NumPy arrays, motions and crowds as files or tables.

    from posefield_client import Client

    with Client("http://localhost:8000") as client:
        client.model("walk").clip(speed=1.4).save("clip.usdc")

Metres, seconds, Y up; quaternions are unit, w x y z, local to the parent. posefield_client.errors
lists the exceptions.
"""

from posefield_client import errors
from posefield_client.aio import AsyncClient, AsyncModel, AsyncMotion, AsyncSaving
from posefield_client.client import Client, Model, Motion, Saving
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
from posefield_client.saving import Missed, Progress, Saved
from posefield_client.scripts import Script
from posefield_client.wire import NEVER, Retry

__all__ = [
    "CONTRACT",
    "NEVER",
    "AsyncClient",
    "AsyncModel",
    "AsyncMotion",
    "AsyncSaving",
    "Camera",
    "Client",
    "ClipNumbers",
    "Control",
    "CrowdPoses",
    "Floor",
    "ManifestEntry",
    "Met",
    "Missed",
    "Model",
    "ModelCard",
    "Motion",
    "NamedClipQuestion",
    "NamedScript",
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
