"""The ladder of levels of detail: what each leaves out, and what that does to its answers.

Core and bases of a level are leading parts of the finer one's. Ranks are chosen from the exact
error table, samples by the answers.
"""

from dataclasses import dataclass, replace

import numpy as np

from model_export import cost, exams, fidelity, ranks, thin
from model_export.decoder import Rung
from model_export.exams import Exam
from model_export.fidelity import Judge
from model_export.hosvd import Multilinear
from model_export.model import Model
from model_export.ranks import Triple
from model_export.recipe import Detail, Recipe
from model_export.thin import Lesson
from model_export.train import Trained
from service.motion.detail import Level
from service.motion.errors import TrainingError

# Truncation may take so much of a budget, and the samples that are not asked the rest; where these
# need more, it takes less.
TRUNCATION = (0.85, 0.7, 0.5)
# Questions to a level that is tried, and to one that was made: rare poses show in many alone.
QUESTIONS, FINALS = 1_000, 4_000
SAMPLES = (4, 6, 8, 12, 16, 24, 32, 48, 64, 96)


@dataclass(frozen=True)
class Laddered:
    """A model of several levels of detail, and what each of them is; the finest comes first."""

    model: Model
    levels: tuple[Level, ...]


@dataclass(frozen=True)
class Workshop:
    """What levels are made with: the whole tensor's decomposition, judges of truncations and of
    answers, and what a level's weights are fitted to. finals: the exam of what was made.

    model: of the finest level alone, its samples in the order in which they say most of the pose.
    budgets: of the finest level, m, by name.
    """

    full: Multilinear
    model: Model
    budgets: dict[str, float]
    judge: Judge
    exam: Exam
    finals: Exam
    lesson: Lesson

    def lowered(self, model: Model, joints: tuple[int, ...], times: float) -> Model:
        """Model with one more level of the least work whose answers keep so many times the
        budgets, or nearly; some joints move."""
        allowed = {name: times * budget for name, budget in self.budgets.items()}
        within, kept = model.decoder.rungs[-1].ranks, []
        for share in TRUNCATION:
            parts = {name: share * most for name, most in allowed.items()}
            rung = Rung(self._ranks(within, parts), joints)
            lowered, keeps = self._thinned(model, rung, allowed)
            kept += [lowered] if keeps else []
        return self._with_own_error(
            min(kept or [lowered], key=lambda m: cost.work(m, len(m.bank.coarse)))
        )

    def level(self, model: Model, level: int) -> Level:
        """What a level of a model is."""
        rung, numbers = model.decoder.rungs[level], cost.read(model, level)
        found = self.finals.errors(model, level, range(len(model.decoder.means)))
        effector = self.finals.effector(model, level)
        return Level(
            rung.ranks,
            model.bank.samples(level),
            rung.joints,
            numbers,
            4 * numbers,
            cost.work(model, level),
            rms=_short(found.rms),
            p99=_short(found.p99),
            max=_short(found.max),
            pose=_short(found.pose),
            effector=None if effector is None else _short(effector),
        )

    def _with_own_error(self, model: Model) -> Model:
        """Model whose last level counts in its sigma how far it lies from the whole model."""
        bank, last = model.bank, len(model.bank.coarse)
        error = self.exam.errors(model, last, range(len(model.decoder.means))).rms
        rank = model.decoder.rungs[last].ranks[2]
        weights = self.lesson.weights(bank.columns(last), rank, error)
        return replace(model, bank=replace(bank, coarse=(*bank.coarse[:-1], weights)))

    def _ranks(self, within: Triple, allowed: dict[str, float]) -> Triple:
        """Fewest multiply-adds within a finer level's ranks whose true errors are allowed."""

        def strain(triple: Triple) -> float:
            found = self.judge.of(self.full.truncated(triple))
            return max(getattr(found, name) / most for name, most in allowed.items())

        own_tensor = self.judge.own_tensor
        price = cost.operations(own_tensor, len(self.model.bank.low))
        places = own_tensor.weight * np.prod(self.judge.whole.shape[:2])
        aim = min(allowed.values()) ** 2 * float(places)
        return ranks.cheapest(ranks.front(self.full.core, price, within), strain, aim)

    def _thinned(self, model: Model, rung: Rung, allowed: dict[str, float]) -> tuple[Model, bool]:
        """Model with one more level, of the fewest covariances whose answers are near enough, and
        whether any are."""
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
    """Model with the levels that a recipe asks for below its own size.

    Raises TrainingError for joints to keep still that there are not, and for the root.
    """
    shop = workshop(recipe, trained)
    model = shop.model
    for detail in recipe.size.details:
        joints = _joints(trained, model.decoder.rungs[-1], detail)
        model = shop.lowered(model, joints, detail.times)
    every = range(len(model.decoder.rungs))
    return Laddered(model, tuple(shop.level(model, level) for level in every))


def workshop(recipe: Recipe, trained: Trained) -> Workshop:
    """Workshop for the levels of a trained model."""
    bank = thin.ordered(trained.model.bank)
    return Workshop(
        trained.full,
        replace(trained.model, bank=bank),
        recipe.size.budgets or {"rms": trained.fidelity.rms},
        fidelity.judge(recipe, trained.examples, trained.tensor),
        exams.of(recipe, trained, QUESTIONS),
        exams.of(recipe, trained, FINALS),
        thin.lesson(bank),
    )


def _short(length: float) -> float:
    return float(f"{length:.4g}")


def _joints(trained: Trained, finer: Rung, detail: Detail) -> tuple[int, ...]:
    """Joints that a level moves: those of the finer one but what it drops and what hangs on it."""
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
    """Numbers of covariances to try for a level below the last: some of the pose's, or all of one
    field after the other."""
    bank, n = model.bank, len(model.bank.pose.samples)
    some = [*(m for m in SAMPLES if m < n), *(n * (f + 1) for f in range(len(bank.kriged)))]
    return [m for m in some if m <= bank.columns(len(bank.coarse))]
