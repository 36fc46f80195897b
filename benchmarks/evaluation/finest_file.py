"""Unchecked files of a model's finest level, for measurements."""

from dataclasses import replace

from posefield.model_file import model_card
from posefield_train.graph import levels, onnx_export, trained_card
from posefield_train.graph.trained_model import TrainedModel
from posefield_train.jobs import single_threaded


@single_threaded()
def export_finest(trained: TrainedModel) -> bytes:
    """Return an unchecked file of the finest level alone."""
    recipe = trained.recipe
    size = recipe.size.model_copy(update={"levels": []})
    # Held-out clips narrow the sampled ranges, which presets have to lie in.
    trained = replace(trained, recipe=recipe.model_copy(update={"size": size, "presets": {}}))
    model, model_levels = levels.build_levels(trained)
    card = trained_card.build_card(trained, model_levels, [], parity=0.0)
    card = onnx_export.estimate(trained).on_card(card)
    return model.onnx(model_card.dump(card), onnx_export.producer())
