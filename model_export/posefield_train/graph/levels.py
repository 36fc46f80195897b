"""Levels of detail: their construction and their errors.

Core and bases of a level are leading parts of the finer one's. Ranks are chosen from the exact
error table, samples by the errors of the outputs.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from posefield.common.errors import TrainingError
from posefield.common.units import Floats
from posefield.model_file.model_card import Level, rounded
from posefield.motion import skeleton
from posefield_train.graph import truncation_cost
from posefield_train.graph.float_model import FloatModel
from posefield_train.graph.trained_model import TrainedModel
from posefield_train.graph.truncation_cost import ParetoFront, RankTriple
from posefield_train.kriging import kriging_bank, performer_means, universal_kriging
from posefield_train.kriging.kriging_bank import ThinningData
from posefield_train.kriging.sample_points import SamplePoints
from posefield_train.source.recipe_sections import Detail
from posefield_train.tensor import truncation_error
from posefield_train.tensor.decoder import LevelSize, build_blend
from posefield_train.tensor.hosvd import TuckerTensor
from posefield_train.tensor.truncation_error import EventFrame, TruncationReference

# Largest ratio of the worst pose's error to the allowed root mean square, when a level is chosen.
TAIL_RATIO = 5.0


def _pose_errors(gaps: Floats) -> Floats:
    """Return the root mean square (Q,) over the joints of each pose, m, of distances (Q, J)."""
    return np.sqrt(np.mean(np.square(gaps), axis=1))


STATISTICS: dict[str, Callable[[Floats], float]] = {
    "rms": lambda gaps: float(np.sqrt(np.mean(np.square(_pose_errors(gaps))))),
    "p99": lambda gaps: float(np.quantile(gaps, 0.99)),
    "max": lambda gaps: float(gaps.max()),
    "pose": lambda gaps: float(_pose_errors(gaps).max()),
}
"""Statistics, m, of distances (Q, J) of joints from the model before truncation, by name.

pose: the worst pose's root mean square over its joints.
"""


@dataclass(frozen=True)
class LevelTest:
    """Random test inputs with the output of the model before truncation.

    controls: (Q, d). labels: (Q, p). times: (Q, 1), s. points: joint positions (Q, J, 3), m, and
    points of the curves behind them. at_event: position (Q, 3) of the event's joint at the event,
    m.
    """

    controls: Floats
    labels: Floats
    times: Floats
    parents: tuple[int, ...]
    moment: EventFrame | None
    points: Floats
    at_event: Floats

    def keeps(self, model: FloatModel, allowed: dict[str, float]) -> bool:
        """Return True if the last level stays within the allowed errors over its moving joints.

        allowed: errors, m, by name in STATISTICS, and of the effector.
        """
        level = len(model.decoder.coarse)
        fields = model.fields(self.controls, self.labels, level)
        gaps = self.gaps(model, level, fields, model.decoder.level_sizes[level].joints)
        if "rms" in allowed and STATISTICS["pose"](gaps) > TAIL_RATIO * allowed["rms"]:
            return False
        joints = {name: limit for name, limit in allowed.items() if name != "effector"}
        if any(STATISTICS[name](gaps) > limit for name, limit in joints.items()):
            return False
        effector = self.effector(model, level, fields) if "effector" in allowed else None
        return effector is None or effector <= allowed["effector"]

    def gaps(
        self, model: FloatModel, level: int, fields: dict[str, Floats], joints: Sequence[int]
    ) -> Floats:
        """Return the distances (Q, J + C), m, of some joints and all curves at a level.

        fields: kriged values (Q, m) at the test inputs, by name.
        """
        outputs = model.outputs_at_times(fields, self.times, level)
        points = outputs.points(self.parents, model.decoder.curves)[:, 0]
        gaps = np.linalg.norm(points - self.points, axis=-1)
        return gaps[:, [*joints, *range(len(self.parents), gaps.shape[1])]]

    def effector(self, model: FloatModel, level: int, fields: dict[str, Floats]) -> float | None:
        """Return the RMS distance, m, of the event's joint at the event; None without event."""
        if self.moment is None:
            return None
        positions = _event_positions(model, fields, level, self.moment, self.parents)
        return float(np.sqrt(np.mean(np.sum(np.square(positions - self.at_event), axis=-1))))


def level_test(trained: TrainedModel, questions: int) -> LevelTest:
    """Return a test of a trained model's levels with the given number of inputs."""
    moment = truncation_error.event_frame(trained.recipe, trained.examples)
    motions = performer_means.move(trained.samples, trained.pose.share, trained.full.bases[2])
    model = untruncated(trained.model, trained.full, trained.samples, motions)
    return level_test_against(model, trained.skeleton.parents, moment, questions)


def level_test_against(
    model: FloatModel, parents: tuple[int, ...], moment: EventFrame | None, questions: int
) -> LevelTest:
    """Return a test with outputs of a model before truncation."""
    bank = model.bank
    points, d = kriging_bank.random_points(bank, 1.0, questions), len(bank.low)
    controls = (points[:, :d] * (bank.high - bank.low) + bank.high + bank.low) / 2.0
    labels = points[:, d:]
    rng = np.random.Generator(np.random.PCG64(len(points)))
    fields = model.fields(controls, labels, 0)
    times = rng.uniform(0.0, 1.0, (len(points), 1)) * np.exp(fields["duration"])
    joints = model.outputs_at_times(fields, times, 0).points(parents, model.decoder.curves)[:, 0]
    event = (
        _event_positions(model, fields, 0, moment, parents)
        if moment
        else np.zeros((len(points), 3))
    )
    return LevelTest(controls, labels, times, parents, moment, joints, event)


def _event_positions(
    model: FloatModel,
    fields: dict[str, Floats],
    level: int,
    moment: EventFrame,
    parents: tuple[int, ...],
) -> Floats:
    """Return positions (Q, 3), m, of the event's joint at its canonical frame."""
    chain = skeleton.joint_chain(parents, moment.joint)
    return model.joint_at_frame(fields, chain, moment.frame, level)


def untruncated(
    model: FloatModel, full: TuckerTensor, samples: SamplePoints, motions: Floats
) -> FloatModel:
    """Return the model with the tensor before truncation.

    samples: of the tensor's clips. motions: values (N, N) of the samples that the pose is kriged
    from, in the coordinates of the tensor's last basis.
    """
    bank = model.bank
    pose = universal_kriging.solve_samples(bank.pose.hyper, samples, motions)
    decoder = replace(model.decoder, reduced=full)
    event, blend = bank.event, model.decoder.event
    if event and blend:
        longer = build_blend(blend.count, blend.weights, full.core, full.bases[1])
        decoder = replace(decoder, event=longer)
        event = universal_kriging.solve_samples(event.hyper, samples, motions[:, : longer.count])
    return replace(model, bank=replace(bank, pose=pose, event=event), decoder=decoder)


# Shares of the error budget for truncation; thinning the samples uses the rest. The share that
# gives the cheapest level is chosen.
TRUNCATION_SHARES = (0.85, 0.7, 0.5)
# Test inputs for a level under construction, and for a finished one; rare poses need many.
TEST_INPUTS, FINALS = 1_000, 4_000
SAMPLE_COUNTS = (4, 6, 8, 12, 16, 24, 32, 48, 64, 96)


@dataclass(frozen=True)
class LevelBuilder:
    """Inputs of the construction of levels.

    full: decomposition of the tensor at full rank. model: finest level alone, with its samples
    sorted by how much they explain of the pose. budgets: allowed errors of the finest level, m, by
    name. reference: for the errors of truncations. draft_test, final_test: for the errors of a
    level under construction, and of a finished one. thinning_data: that weights are fitted to.
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
        price = truncation_cost.operation_cost(self.reference.tensor, len(self.model.bank.low))
        front = truncation_cost.pareto_front(
            self.full.core, price, model.decoder.level_sizes[-1].ranks
        )
        within_limits = []
        for share in TRUNCATION_SHARES:
            rank_limits = {name: share * limit for name, limit in allowed.items()}
            size = LevelSize(self._ranks(front, rank_limits), joints)
            lowered, keeps = self._thinned(model, size, allowed)
            within_limits += [lowered] if keeps else []
        chosen = min(
            within_limits or [lowered],
            key=lambda m: truncation_cost.count_operations(m, len(m.bank.coarse)),
        )
        # The last level's error relative to the full model belongs to its sigma.
        bank, last = chosen.bank, len(chosen.bank.coarse)
        test, all_joints = self.draft_test, range(len(chosen.decoder.means))
        fields = chosen.fields(test.controls, test.labels, last)
        error = STATISTICS["rms"](test.gaps(chosen, last, fields, all_joints))
        rank = chosen.decoder.level_sizes[last].ranks[2]
        weights = self.thinning_data.weights(bank.columns(last), rank, error)
        return replace(chosen, bank=replace(bank, coarse=(*bank.coarse[:-1], weights)))

    def level(self, model: FloatModel, level: int) -> Level:
        """Return the description of a level of a model."""
        size = model.decoder.level_sizes[level]
        numbers = truncation_cost.count_numbers(model, level)
        test = self.final_test
        fields = model.fields(test.controls, test.labels, level)
        gaps = test.gaps(model, level, fields, range(len(model.decoder.means)))
        effector = test.effector(model, level, fields)
        return Level(
            size.ranks,
            model.bank.columns(level),
            size.joints,
            numbers,
            4 * numbers,
            truncation_cost.count_operations(model, level),
            **{name: rounded(statistic(gaps)) for name, statistic in STATISTICS.items()},
            effector=None if effector is None else rounded(effector),
            event=0 if level else model.bank.event_columns,
        )

    def _ranks(self, front: ParetoFront, allowed: dict[str, float]) -> RankTriple:
        """Return the cheapest ranks of a front whose true errors are allowed."""

        def strain(triple: RankTriple) -> float:
            return self.reference.strain(self.full.truncated(triple), allowed)

        point_count = self.reference.tensor.weight * np.prod(self.reference.points.shape[:2])
        aim = min(allowed.values()) ** 2 * float(point_count)
        return truncation_cost.cheapest_within(front, strain, aim)

    def _thinned(
        self, model: FloatModel, size: LevelSize, allowed: dict[str, float]
    ) -> tuple[FloatModel, bool]:
        """Return the model with one more level of the fewest covariances within the allowed errors.

        The second value is False if no number of covariances suffices.
        """
        bank, decoder = model.bank, model.decoder
        decoder = replace(decoder, coarse=(*decoder.coarse, size))
        # Some samples of the pose's model, or whole models.
        n = len(bank.pose.samples)
        counts = [*(m for m in SAMPLE_COUNTS if m < n), n]
        for columns in (m for m in counts if m <= bank.columns(len(bank.coarse))):
            weights = self.thinning_data.weights(columns, size.ranks[2], error=0.0)
            coarse = (*bank.coarse, weights)
            tried = replace(model, bank=replace(bank, coarse=coarse), decoder=decoder)
            if self.draft_test.keeps(tried, allowed):
                return tried, True
        return tried, False


def build_levels(trained: TrainedModel) -> tuple[FloatModel, tuple[Level, ...]]:
    """Return the model with the levels of its recipe, and their descriptions, the finest first.

    Raises TrainingError for unknown joints to fix, and for the root.
    """
    builder = level_builder(trained)
    model = builder.model
    for detail in trained.recipe.size.details:
        joints = _moving_joints(trained, model.decoder.level_sizes[-1], detail)
        model = builder.with_coarser_level(model, joints, detail.times)
    indices = range(len(model.decoder.level_sizes))
    return model, tuple(builder.level(model, level) for level in indices)


def level_builder(trained: TrainedModel) -> LevelBuilder:
    """Return the inputs of the construction of levels for a trained model."""
    recipe, bank = trained.recipe, kriging_bank.sort_samples(trained.model.bank)
    return LevelBuilder(
        trained.full,
        replace(trained.model, bank=bank),
        recipe.size.budgets or {"rms": trained.truncation_errors.rms},
        truncation_error.truncation_reference(recipe, trained.examples, trained.tensor),
        level_test(trained, TEST_INPUTS),
        level_test(trained, FINALS),
        kriging_bank.thinning_data(bank),
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
