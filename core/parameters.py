"""Parameters with units and bounds, and the unit cube that estimators see."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from .arrays import FloatArray
from .errors import InputError

Scale = Literal["linear", "log"]


@dataclass(frozen=True)
class Parameter:
    """One scalar with a unit and a range.

    Args:
        name: material field (``stretch_stiffness``), ``scale``, or ``effect.coefficient``.
        unit: SI unit as text, ``"1"`` for a pure number.
        low, high: bounds of the prior [unit].
        scale: ``"log"`` makes the prior uniform in the logarithm.
        description: one line for people.
    """

    name: str
    unit: str
    low: float
    high: float
    scale: Scale = "linear"
    description: str = ""

    def __post_init__(self) -> None:
        if not (np.isfinite(self.low) and np.isfinite(self.high)) or self.low >= self.high:
            raise InputError(
                f"parameter {self.name!r}: low must be below high and both finite, "
                f"but low = {self.low:g} and high = {self.high:g} {self.unit}"
            )
        if self.scale not in ("linear", "log"):
            raise InputError(f"parameter {self.name!r}: scale must be 'linear' or 'log', not {self.scale!r}")
        if self.scale == "log" and self.low <= 0:
            raise InputError(
                f"parameter {self.name!r}: a log scale needs low above zero, but low = {self.low:g}; "
                "raise low or use scale = 'linear'"
            )


@dataclass(frozen=True)
class ParameterSpace:
    """An ordered box of parameters with a uniform prior on the unit cube.

    Values are vectors ``(..., D)`` in the order of :attr:`parameters`.
    """

    parameters: tuple[Parameter, ...]

    def __post_init__(self) -> None:
        names = [p.name for p in self.parameters]
        twice = sorted({n for n in names if names.count(n) > 1})
        if twice:
            raise InputError(f"parameter named twice: {', '.join(twice)}")

    def __len__(self) -> int:
        return len(self.parameters)

    def __iter__(self) -> Iterator[Parameter]:
        return iter(self.parameters)

    def __add__(self, other: "ParameterSpace") -> "ParameterSpace":
        return ParameterSpace(self.parameters + other.parameters)

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(p.name for p in self.parameters)

    @property
    def units(self) -> tuple[str, ...]:
        return tuple(p.unit for p in self.parameters)

    def _bounds(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        log = np.array([p.scale == "log" for p in self.parameters])
        low = np.array([p.low for p in self.parameters])
        high = np.array([p.high for p in self.parameters])
        safe_low, safe_high = np.where(log, low, 1.0), np.where(log, high, 1.0)
        return log, np.where(log, np.log(safe_low), low), np.where(log, np.log(safe_high), high)

    def to_unit(self, values: FloatArray) -> FloatArray:
        """Values ``(..., D)`` [units] to the unit cube; points outside the box map outside ``[0, 1]``."""
        log, low, high = self._bounds()
        v = np.asarray(values, float)
        x = np.where(log, np.log(np.where(log, np.maximum(v, 1e-300), 1.0)), v)
        return np.asarray((x - low) / (high - low))

    def from_unit(self, unit: FloatArray) -> FloatArray:
        """Inverse of :meth:`to_unit`."""
        log, low, high = self._bounds()
        x = low + np.asarray(unit, float) * (high - low)
        return np.asarray(np.where(log, np.exp(np.where(log, x, 0.0)), x))

    def as_dict(self, values: FloatArray | Sequence[float]) -> dict[str, float]:
        return {n: float(v) for n, v in zip(self.names, np.asarray(values, float), strict=True)}
