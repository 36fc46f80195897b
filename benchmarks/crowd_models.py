"""Models that crowds are measured with, open as the service has them."""

from pathlib import Path

from family import Family

from posefield.inference import session
from posefield.locomotion import gait
from posefield.locomotion.gait import Gait
from posefield.synthesis.synthesizer import Synthesizer

WALK = Path(__file__).parents[1] / "service/posefield/shipped/cmu_walk.onnx"


def reaching(trained_family: Family) -> Synthesizer:
    """Return the procedural family's model."""
    return Synthesizer(
        "reaching", session.open_bytes(trained_family.exported.content, "reaching.onnx")
    )


def walks() -> dict[str, Gait]:
    """Return the gait of the shipped walk."""
    return {"CMU walk": gait.fit_gait(session.load(WALK))}
