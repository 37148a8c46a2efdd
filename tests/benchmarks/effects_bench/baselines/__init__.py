"""Simple rivals of the diagnosis, on the same cases: each says a name, or none."""

from collections.abc import Callable

from .amortised import amortised
from .bic import bic
from .correlation import correlation
from .residual_network import residual_network
from .sindy import sindy
from .trial import Answer, Fitted, Trial, make_trial

BASELINES: dict[str, Callable[[Trial], Answer]] = {
    "correlation": correlation,
    "bic": bic,
    "amortised": amortised,
    "sindy": sindy,
    "residual-network": residual_network,
}

__all__ = ["BASELINES", "Answer", "Fitted", "Trial", "make_trial"]
