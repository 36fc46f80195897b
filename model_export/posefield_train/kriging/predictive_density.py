"""Tuning loss of a quantity of one value: the density that left-out takes have by the prediction.

The squared residuals of a single value say little about the nugget: a model that follows every
sample and one that smooths them may miss alike. Their density also asks whether the variances that
the model states fit the residuals; Rasmussen & Williams, Gaussian Processes for Machine Learning
(2006), section 5.4.2, here with whole takes left out and the sill that fits best.
"""

from dataclasses import dataclass

import numpy as np

from posefield.common.array_shapes import SampleMatrix
from posefield.kriging import leave_one_out
from posefield_train.kriging.tuning_loss import LeaveOneOutLoss
from posefield_train.kriging.universal_kriging import Hyper


@dataclass(frozen=True)
class PredictiveDensityLoss(LeaveOneOutLoss):
    """Negative logarithm of the density of left-out takes; the event's joint has no weight.

    The density is that of each take by the prediction from all others, with its covariance.
    """

    def of_samples(self, hyper: Hyper) -> tuple[float, SampleMatrix]:
        """Return the loss without the prior, and its derivative (n, n) by the covariances.

        With B and U as in `LeaveOneOutLoss` a take's residuals B_gg⁻¹ U_g have the covariance
        B_gg⁻¹, in units of the sill. Of several values the loss is that of their mean density.
        """
        block = self.inverse(hyper)
        product = block @ self.values
        residuals = leave_one_out.divide_groups(block, product, self.takes)
        own = np.where(self.together, block, 0.0)
        squares, count = float(np.sum(residuals * product)), len(block)
        loss = 0.5 * count * float(np.log(squares)) - 0.5 * float(np.linalg.slogdet(own)[1])
        paired = np.where(self.together, residuals @ residuals.T, 0.0)
        slope = block @ paired @ block - 2.0 * (block @ residuals) @ product.T
        spread = block @ np.linalg.inv(own) @ block
        both = 0.5 * count / squares * slope + 0.5 * spread
        return loss, 0.5 * (both + both.T)
