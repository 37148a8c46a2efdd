"""How large a sum of squared residuals may be before it is a misfit."""

import numpy as np

#: Misfit that is not worth an explanation: excess over the noise variance, as a share of it.
NEGLIGIBLE = 0.10


def is_misfit(rss: float, count: float, noise_error: float, unsure: float = 0.0) -> bool:
    """Is there more than the noise, and what is not known of it, explain?

    Args:
        rss: residual sum of squares [noise variances].
        count: degrees of freedom: independent residuals less parameters.
        noise_error: relative standard error of the noise's standard deviation.
        unsure: what else may be there or not, as the model cannot be repeated.
    """
    allowed = max(NEGLIGIBLE, 6 * noise_error + 4 * np.sqrt(2 / count)) + unsure / count
    return bool(rss / count > 1 + allowed)


def chance(count: float, noise_error: float) -> float:
    """What noise may leave beyond ``count``: four standard deviations of its sum, and two of its estimate."""
    return float(4.0 * np.sqrt(2.0 * count) + 4.0 * noise_error * count)
