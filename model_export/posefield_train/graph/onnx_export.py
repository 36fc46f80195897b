"""Export of a trained model to one file, after a parity check."""

from collections.abc import Callable
from dataclasses import dataclass

from posefield import __version__
from posefield.model_file import model_card
from posefield.model_file.model_card import ModelCard
from posefield_train.graph import (
    levels,
    parity_check,
    take_statistics,
    trained_card,
    training_notes,
)
from posefield_train.graph.float_model import FloatModel
from posefield_train.graph.trained_model import TrainedModel
from posefield_train.parallel import single_thread
from posefield_train.source.recipe import Recipe


@dataclass(frozen=True)
class ExportedModel:
    """An exported model.

    model: of all levels. content: bytes of its file. card: its model card. parity: largest joint
    error of the parity check, m.
    """

    model: FloatModel
    content: bytes
    card: ModelCard
    parity: float


@single_thread.single_threaded()
def export_model(recipe: Recipe, trained: TrainedModel, notes: list[str]) -> ExportedModel:
    """Return the exported model with all its levels; equal data give equal bytes.

    Raises TrainingError for levels of detail that cannot be made, and ExportRefused if the parity
    check fails.
    """
    notes = training_notes.training_notes(recipe, trained, notes)
    laddered = levels.build_levels(recipe, trained)
    takes = take_statistics.estimate(trained)
    found = laddered.levels

    def own_card(parity: float) -> ModelCard:
        return takes.on_card(trained_card.build_card(recipe, trained, found, notes, parity))

    return check_and_export(laddered.model, own_card)


def check_and_export(model: FloatModel, own_card: Callable[[float], ModelCard]) -> ExportedModel:
    """Check a model of all its levels and return it with its file.

    own_card: makes the model card from the parity error, m. Raises ExportRefused as
    `parity_check.check_parity` does.
    """
    about = _producer()
    # The card contains the parity error, so the weights are checked with a draft of the card.
    draft = own_card(0.0)
    parity = parity_check.check_parity(model, model.onnx(model_card.dump(draft), about), draft)
    written = own_card(parity)
    return ExportedModel(model, model.onnx(model_card.dump(written), about), written, parity)


@single_thread.single_threaded()
def export_finest(recipe: Recipe, trained: TrainedModel) -> bytes:
    """Return an unchecked file of the finest level alone, for measurements only."""
    size = recipe.size.model_copy(update={"levels": []})
    # Held-out clips narrow the sampled ranges, which presets have to lie in.
    alone = recipe.model_copy(update={"size": size, "presets": {}})
    laddered = levels.build_levels(alone, trained)
    own_card = trained_card.build_card(alone, trained, laddered.levels, [], parity=0.0)
    own_card = take_statistics.estimate(trained).on_card(own_card)
    return laddered.model.onnx(model_card.dump(own_card), _producer())


def _producer() -> dict[str, str]:
    return {"producer_name": "posefield", "producer_version": __version__}
