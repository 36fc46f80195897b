"""Levels of detail: their construction and their errors.

Core and bases of a level are leading parts of the finer one's. Ranks are chosen from the exact
error table, samples by the errors of the outputs.
"""

from dataclasses import dataclass, replace

import numpy as np

from posefield.common.errors import TrainingError
from posefield.model_file.level_of_detail import Level
from posefield.model_file.model_card import rounded
from posefield_train.graph import level_errors, ranks, truncation_cost
from posefield_train.graph.float_model import FloatModel
from posefield_train.graph.level_errors import LevelTest
from posefield_train.graph.ranks import ParetoFront, RankTriple
from posefield_train.graph.trained_model import TrainedModel
from posefield_train.kriging import thinning
from posefield_train.kriging.thinning import ThinningData
from posefield_train.source.recipe import Recipe
from posefield_train.source.recipe_sections import Detail
from posefield_train.tensor import truncation_error
from posefield_train.tensor.decoder import LevelSize
from posefield_train.tensor.hosvd import TuckerTensor
from posefield_train.tensor.truncation_error import TruncationReference

# Shares of the error budget for truncation; thinning the samples uses the rest. The share that
# gives the cheapest level is chosen.
TRUNCATION_SHARES = (0.85, 0.7, 0.5)
# Test inputs for a level under construction, and for a finished one; rare poses need many.
TEST_INPUTS, FINALS = 1_000, 4_000
SAMPLE_COUNTS = (4, 6, 8, 12, 16, 24, 32, 48, 64, 96)


@dataclass(frozen=True)
class ModelLevels:
    """A model of several levels of detail and the description of each, the finest first."""

    model: FloatModel
    levels: tuple[Level, ...]


@dataclass(frozen=True)
class LevelBuilder:
    """Inputs of the construction of levels.

    full: decomposition of the tensor at full rank. model: finest level alone, with its samples
    sorted by how much they explain of the pose. budgets: allowed errors of the finest level, m, by
    name. judge: errors of truncations. exam: errors of a level under construction. finals: errors
    of a finished level. lesson: data that a level's weights are fitted to.
    """

    full: TuckerTensor
    model: FloatModel
    budgets: dict[str, float]
    reference: TruncationReference
    draft_test: LevelTest
    final_test: LevelTest
    thinning_data: ThinningData

    def with_coarser_level(
        self, model: FloatModel, joints: tuple[int, ...], times: float
    ) -> FloatModel:
        """Return the model with one more level, the cheapest with errors below `times` the budgets.

        joints: those that move. If no level stays within the budgets, the last one tried is used.
        """
        allowed = {name: times * budget for name, budget in self.budgets.items()}
        price = truncation_cost.operation_cost(self.reference.own_tensor, len(self.model.bank.low))
        front = ranks.pareto_front(self.full.core, price, model.decoder.level_sizes[-1].ranks)
        kept = []
        for share in TRUNCATION_SHARES:
            parts = {name: share * most for name, most in allowed.items()}
            rung = LevelSize(self._ranks(front, parts), joints)
            lowered, keeps = self._thinned(model, rung, allowed)
            kept += [lowered] if keeps else []
        return self._with_level_error(
            min(
                kept or [lowered],
                key=lambda m: truncation_cost.count_operations(m, len(m.bank.coarse)),
            )
        )

    def level(self, model: FloatModel, level: int) -> Level:
        """Return the description of a level of a model."""
        rung, numbers = (
            model.decoder.level_sizes[level],
            truncation_cost.count_numbers(model, level),
        )
        answers = self.final_test.outputs(model, level)
        found = answers.errors(range(len(model.decoder.means)))
        effector = answers.effector
        return Level(
            rung.ranks,
            model.bank.columns(level),
            rung.joints,
            numbers,
            4 * numbers,
            truncation_cost.count_operations(model, level),
            rms=rounded(found.rms),
            p99=rounded(found.p99),
            max=rounded(found.max),
            pose=rounded(found.pose),
            effector=None if effector is None else rounded(effector),
            event=0 if level else model.bank.event_columns,
        )

    def _with_level_error(self, model: FloatModel) -> FloatModel:
        """Return the model with the last level's error relative to the full model in its sigma."""
        bank, last = model.bank, len(model.bank.coarse)
        error = self.draft_test.outputs(model, last).errors(range(len(model.decoder.means))).rms
        rank = model.decoder.level_sizes[last].ranks[2]
        weights = self.thinning_data.weights(bank.columns(last), rank, error)
        return replace(model, bank=replace(bank, coarse=(*bank.coarse[:-1], weights)))

    def _ranks(self, front: ParetoFront, allowed: dict[str, float]) -> RankTriple:
        """Return the cheapest ranks of a front whose true errors are allowed."""

        def strain(triple: RankTriple) -> float:
            return self.reference.strain(self.full.truncated(triple), allowed)

        places = self.reference.own_tensor.weight * np.prod(self.reference.whole.shape[:2])
        aim = min(allowed.values()) ** 2 * float(places)
        return ranks.cheapest_within(front, strain, aim)

    def _thinned(
        self, model: FloatModel, rung: LevelSize, allowed: dict[str, float]
    ) -> tuple[FloatModel, bool]:
        """Return the model with one more level of the fewest covariances within the allowed errors.

        The second value is False if no number of covariances suffices.
        """
        bank, decoder = model.bank, model.decoder
        decoder = replace(decoder, coarse=(*decoder.coarse, rung))
        for columns in _covariance_counts(model):
            weights = self.thinning_data.weights(columns, rung.ranks[2], error=0.0)
            coarse = (*bank.coarse, weights)
            tried = replace(model, bank=replace(bank, coarse=coarse), decoder=decoder)
            if self.draft_test.keeps(tried, allowed):
                return tried, True
        return tried, False


def build_levels(recipe: Recipe, trained: TrainedModel) -> ModelLevels:
    """Return the model with the levels of a recipe.

    Raises TrainingError for unknown joints to fix, and for the root.
    """
    shop = level_builder(recipe, trained)
    model = shop.model
    for detail in recipe.size.details:
        joints = _moving_joints(trained, model.decoder.level_sizes[-1], detail)
        model = shop.with_coarser_level(model, joints, detail.times)
    every = range(len(model.decoder.level_sizes))
    return ModelLevels(model, tuple(shop.level(model, level) for level in every))


def level_builder(recipe: Recipe, trained: TrainedModel) -> LevelBuilder:
    """Return the inputs of the construction of levels for a trained model."""
    bank = thinning.sort_samples(trained.model.bank)
    return LevelBuilder(
        trained.full,
        replace(trained.model, bank=bank),
        recipe.size.budgets or {"rms": trained.truncation_errors.rms},
        truncation_error.truncation_reference(recipe, trained.examples, trained.tensor),
        level_errors.level_test(recipe, trained, TEST_INPUTS),
        level_errors.level_test(recipe, trained, FINALS),
        thinning.thinning_data(bank),
    )


def _moving_joints(trained: TrainedModel, finer: LevelSize, detail: Detail) -> tuple[int, ...]:
    """Return the joints that a level moves: the finer level's without dropped subtrees."""
    names, parents = trained.skeleton.names, trained.skeleton.parents
    unknown = sorted(set(detail.drop_joints) - set(names[1:]))
    if unknown:
        raise TrainingError(
            f"size.levels.drop_joints {unknown}, expected some of {', '.join(names[1:])}"
        )
    still = [name in detail.drop_joints for name in names]
    for joint, parent in enumerate(parents[1:], start=1):
        still[joint] |= still[parent]
    return tuple(joint for joint in finer.joints if not still[joint])


def _covariance_counts(model: FloatModel) -> list[int]:
    """Return the numbers of covariances to try for the next level.

    They cover some samples of the pose's model, or whole models.
    """
    bank, n = model.bank, len(model.bank.pose.samples)
    some = [*(m for m in SAMPLE_COUNTS if m < n), n]
    return [m for m in some if m <= bank.columns(len(bank.coarse))]
