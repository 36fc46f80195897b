"""Levels of detail: their construction and their errors.

Core and bases of a level are leading parts of the finer one's. Ranks are chosen from the exact
error table, samples by the errors of the outputs.
"""

from dataclasses import dataclass, replace

import numpy as np

from posefield.common.errors import TrainingError
from posefield.model_file.level_of_detail import Level
from posefield_train.graph import level_errors, ranks, truncation_cost
from posefield_train.graph.float_model import Model
from posefield_train.graph.level_errors import Exam
from posefield_train.graph.ranks import Front, Triple
from posefield_train.graph.trained_model import Trained
from posefield_train.kriging import thinning
from posefield_train.kriging.thinning import Lesson
from posefield_train.source.recipe import Detail, Recipe
from posefield_train.tensor import truncation_error
from posefield_train.tensor.decoder import Rung
from posefield_train.tensor.hosvd import Multilinear
from posefield_train.tensor.truncation_error import Judge

# Shares of the error budget for truncation; thinning the samples uses the rest. The share that
# gives the cheapest level is chosen.
TRUNCATION = (0.85, 0.7, 0.5)
# Test inputs for a level under construction, and for a finished one; rare poses need many.
QUESTIONS, FINALS = 1_000, 4_000
SAMPLES = (4, 6, 8, 12, 16, 24, 32, 48, 64, 96)


@dataclass(frozen=True)
class Laddered:
    """A model of several levels of detail and the description of each, the finest first."""

    model: Model
    levels: tuple[Level, ...]


@dataclass(frozen=True)
class Workshop:
    """Inputs of the construction of levels.

    full: decomposition of the tensor at full rank. model: finest level alone, with its samples
    sorted by how much they explain of the pose. budgets: allowed errors of the finest level, m, by
    name. judge: errors of truncations. exam: errors of a level under construction. finals: errors
    of a finished level. lesson: data that a level's weights are fitted to.
    """

    full: Multilinear
    model: Model
    budgets: dict[str, float]
    judge: Judge
    exam: Exam
    finals: Exam
    lesson: Lesson

    def lowered(self, model: Model, joints: tuple[int, ...], times: float) -> Model:
        """Return the model with one more level, the cheapest with errors below `times` the budgets.

        joints: those that move. If no level stays within the budgets, the last one tried is used.
        """
        allowed = {name: times * budget for name, budget in self.budgets.items()}
        price = truncation_cost.operations(self.judge.own_tensor, len(self.model.bank.low))
        front = ranks.front(self.full.core, price, model.decoder.rungs[-1].ranks)
        kept = []
        for share in TRUNCATION:
            parts = {name: share * most for name, most in allowed.items()}
            rung = Rung(self._ranks(front, parts), joints)
            lowered, keeps = self._thinned(model, rung, allowed)
            kept += [lowered] if keeps else []
        return self._with_own_error(
            min(kept or [lowered], key=lambda m: truncation_cost.work(m, len(m.bank.coarse)))
        )

    def level(self, model: Model, level: int) -> Level:
        """Return the description of a level of a model."""
        rung, numbers = model.decoder.rungs[level], truncation_cost.read(model, level)
        answers = self.finals.answers(model, level)
        found = answers.errors(range(len(model.decoder.means)))
        effector = answers.effector
        return Level(
            rung.ranks,
            model.bank.samples(level),
            rung.joints,
            numbers,
            4 * numbers,
            truncation_cost.work(model, level),
            rms=_short(found.rms),
            p99=_short(found.p99),
            max=_short(found.max),
            pose=_short(found.pose),
            effector=None if effector is None else _short(effector),
        )

    def _with_own_error(self, model: Model) -> Model:
        """Return the model with the last level's error relative to the full model in its sigma."""
        bank, last = model.bank, len(model.bank.coarse)
        error = self.exam.answers(model, last).errors(range(len(model.decoder.means))).rms
        rank = model.decoder.rungs[last].ranks[2]
        weights = self.lesson.weights(bank.columns(last), rank, error)
        return replace(model, bank=replace(bank, coarse=(*bank.coarse[:-1], weights)))

    def _ranks(self, front: Front, allowed: dict[str, float]) -> Triple:
        """Return the cheapest ranks of a front whose true errors are allowed."""

        def strain(triple: Triple) -> float:
            return self.judge.strain(self.full.truncated(triple), allowed)

        places = self.judge.own_tensor.weight * np.prod(self.judge.whole.shape[:2])
        aim = min(allowed.values()) ** 2 * float(places)
        return ranks.cheapest(front, strain, aim)

    def _thinned(self, model: Model, rung: Rung, allowed: dict[str, float]) -> tuple[Model, bool]:
        """Return the model with one more level of the fewest covariances within the allowed errors.

        The second value is False if no number of covariances suffices.
        """
        bank, decoder = model.bank, model.decoder
        decoder = replace(decoder, coarse=(*decoder.coarse, rung))
        for columns in _columns(model):
            weights = self.lesson.weights(columns, rung.ranks[2], error=0.0)
            coarse = (*bank.coarse, weights)
            tried = replace(model, bank=replace(bank, coarse=coarse), decoder=decoder)
            if self.exam.keeps(tried, allowed):
                return tried, True
        return tried, False


def build(recipe: Recipe, trained: Trained) -> Laddered:
    """Return the model with the levels of a recipe.

    Raises TrainingError for unknown joints to fix, and for the root.
    """
    shop = workshop(recipe, trained)
    model = shop.model
    for detail in recipe.size.details:
        joints = _joints(trained, model.decoder.rungs[-1], detail)
        model = shop.lowered(model, joints, detail.times)
    every = range(len(model.decoder.rungs))
    return Laddered(model, tuple(shop.level(model, level) for level in every))


def workshop(recipe: Recipe, trained: Trained) -> Workshop:
    """Return the inputs of the construction of levels for a trained model."""
    bank = thinning.ordered(trained.model.bank)
    return Workshop(
        trained.full,
        replace(trained.model, bank=bank),
        recipe.size.budgets or {"rms": trained.fidelity.rms},
        truncation_error.judge(recipe, trained.examples, trained.tensor),
        level_errors.of(recipe, trained, QUESTIONS),
        level_errors.of(recipe, trained, FINALS),
        thinning.lesson(bank),
    )


def _short(length: float) -> float:
    return float(f"{length:.4g}")


def _joints(trained: Trained, finer: Rung, detail: Detail) -> tuple[int, ...]:
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


def _columns(model: Model) -> list[int]:
    """Return the numbers of covariances to try for the next level.

    They cover some samples of the pose's model, or whole models.
    """
    bank, n = model.bank, len(model.bank.pose.samples)
    some = [*(m for m in SAMPLES if m < n), *(n * (f + 1) for f in range(len(bank.kriged)))]
    return [m for m in some if m <= bank.columns(len(bank.coarse))]
