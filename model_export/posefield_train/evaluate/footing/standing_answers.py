"""Answers of the service with feet as predicted and with standing feet, for held-out clips."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from posefield.feet import limb_choice
from posefield.inference import session
from posefield.motion.clip import Clip
from posefield.question.motion_question import ClipQuestion, FeetMode, LabelValue
from posefield.synthesis import clips
from posefield.synthesis.synthesizer import Synthesizer
from posefield_train.evaluate.footing import foot_quality
from posefield_train.evaluate.footing.foot_quality import FootQuality
from posefield_train.source.ingest import Example

Distance = Callable[[Clip, Clip], float]
"""Distance of a made clip from a captured one, m."""


@dataclass(frozen=True)
class FeetAnswer:
    """Measures of one held-out clip: as captured, as predicted, and with standing feet.

    predicted_error, standing_error: mean relative distance from the captured clip after time
    warping, m. lowered: largest distance by which the pelvis was lowered, m.
    """

    captured: FootQuality
    predicted: FootQuality
    standing: FootQuality
    predicted_error: float
    standing_error: float
    lowered: float


def feet_answers(
    name: str, file: bytes, held: Sequence[Example], distance: Distance
) -> list[FeetAnswer]:
    """Return the answers of a model file for held-out clips, with their labels known.

    Empty for a model whose feet do not stand: in place, without feet, or without legs.
    """
    model = Synthesizer(name, session.open_bytes(file, name))
    card = model.session.card
    own = card.skeleton
    legs = limb_choice.choose_limbs(own.parents, own.offsets, card.feet, ()).character.legs
    if not legs or card.root != "travelling":
        return []
    feet, knees = tuple(leg.tip for leg in legs), tuple(leg.middle for leg in legs)
    return [_feet_answer(model, example, (feet, knees), distance) for example in held]


def _feet_answer(
    model: Synthesizer,
    example: Example,
    joints: tuple[tuple[int, ...], tuple[int, ...]],
    distance: Distance,
) -> FeetAnswer:
    """Return the measures of one clip. joints: of the feet and of the knees."""
    clip = example.captured or example.clip
    rate = min(foot_quality.HIGHEST_RATE, clip.rate)
    predicted = clips.synthesize_clip(model, _question(model, example, rate, "as_predicted"))
    standing = clips.synthesize_clip(model, _question(model, example, rate, "stand"))
    report = standing.trust.feet
    return FeetAnswer(
        foot_quality.measure(clip, rate, *joints),
        foot_quality.measure(predicted.clip, rate, *joints),
        foot_quality.measure(standing.clip, rate, *joints),
        distance(predicted.clip, clip),
        distance(standing.clip, clip),
        report.lowered if report else 0.0,
    )


def _question(model: Synthesizer, example: Example, rate: float, feet: FeetMode) -> ClipQuestion:
    card = model.session.card
    known = {own.name: set(own.names) for own in card.labels}
    labels: dict[str, LabelValue] = {
        name: value for name, value in example.row.labels.items() if value in known.get(name, ())
    }
    controls = {
        control.name: float(value)
        for control, value in zip(card.controls, example.controls, strict=True)
    }
    return ClipQuestion(
        controls=controls, labels=labels, extrapolate="ok", exact="none", fps=rate, feet=feet
    )
