"""Materials in SI. The same numbers mean the same object on every backend."""

from dataclasses import dataclass, fields, replace
from typing import Any, ClassVar, TypeAlias, TypeVar, cast

import numpy as np

from .arrays import FloatArray
from .errors import InputError
from .parameters import Parameter


def _check(material: "Material") -> None:
    for f in fields(material):
        value = getattr(material, f.name)
        if not value >= 0 or value == float("inf"):
            raise InputError(f"material: {f.name} must be finite and not negative, but is {value!r}")
    for name in _POSITIVE:
        if getattr(material, name, 1.0) <= 0:
            raise InputError(f"material: {name} must be above zero, but is {getattr(material, name)!r}")
    if not isinstance(material, RopeMaterial) and material.poisson_ratio >= 0.5:
        raise InputError(f"material: poisson_ratio must be below 0.5, but is {material.poisson_ratio:g}")


_POSITIVE = (
    "areal_density",
    "linear_density",
    "density",
    "diameter",
    "stretch_stiffness",
    "youngs_modulus",
    "weft_stretch_ratio",
    "weft_bending_ratio",
    "end_bending_ratio",
    "far_bending_ratio",
)


@dataclass(frozen=True)
class ClothMaterial:
    """A thin sheet, isotropic or woven.

    With a ratio r of weft over warp the stiffness along the warp is S / sqrt(r) and along the weft S sqrt(r),
    so that S is their geometric mean; shear stays S / (2 (1 + nu)) and nu is the geometric mean of both
    Poisson ratios.

    Args:
        areal_density: mass per area [kg/m2].
        stretch_stiffness: Young's modulus times thickness, E t [N/m].
        bending_rigidity: D [N m], moment per length and curvature.
        poisson_ratio: in-plane [1].
        damping_time: stiffness-proportional damping, the beta of C = beta K [s].
        friction: Coulomb coefficient against an obstacle of friction 1 [1].
        weft_stretch_ratio: E t along the weft over that along the warp [1].
        weft_bending_ratio: D along the weft over that along the warp [1].
    """

    areal_density: float = 0.15
    stretch_stiffness: float = 300.0
    bending_rigidity: float = 2e-5
    poisson_ratio: float = 0.3
    damping_time: float = 0.005
    friction: float = 0.3
    weft_stretch_ratio: float = 1.0
    weft_bending_ratio: float = 1.0

    kind: ClassVar[str] = "cloth"

    def __post_init__(self) -> None:
        _check(self)

    @property
    def density(self) -> float:
        """Mass per measure of an element (area) [kg/m2]."""
        return self.areal_density


@dataclass(frozen=True)
class RopeMaterial:
    r"""A rope, cable or rod, as stiff everywhere or not.

    At the share s of its length it has E I times :math:`\sqrt{r}^{\cos 2 \pi s} \sqrt{q}^{- \cos \pi s}`, with r and q
    the last two ratios, so that E I is the geometric mean along it.

    Args:
        linear_density: mass per length [kg/m].
        stretch_stiffness: Young's modulus times cross-section, E A [N].
        bending_rigidity: E I [N m2], moment per curvature.
        twist_rigidity: G J [N m2], torque per twist rate.
        diameter: of its round cross-section, for contact and drag [m].
        damping_time: stiffness-proportional damping, the beta of C = beta K [s].
        friction: Coulomb coefficient against an obstacle of friction 1 [1].
        end_bending_ratio: E I at the ends over that in the middle [1].
        far_bending_ratio: E I at the last end over that at the first [1].
    """

    linear_density: float = 0.05
    stretch_stiffness: float = 500.0
    bending_rigidity: float = 1e-4
    twist_rigidity: float = 1e-4
    diameter: float = 0.008
    damping_time: float = 0.0
    friction: float = 0.3
    end_bending_ratio: float = 1.0
    far_bending_ratio: float = 1.0

    kind: ClassVar[str] = "rope"

    def __post_init__(self) -> None:
        _check(self)

    @property
    def density(self) -> float:
        """Mass per measure of an element (length) [kg/m]."""
        return self.linear_density

    @property
    def is_even(self) -> bool:
        """Whether it is as stiff in bending everywhere."""
        return self.end_bending_ratio == 1.0 == self.far_bending_ratio

    def bending_shares(self, along: FloatArray) -> FloatArray:
        """E I over its mean ``(N,)`` [1] at the shares ``along (N,)`` of the length."""
        ends, far = 0.5 * np.log(self.end_bending_ratio), 0.5 * np.log(self.far_bending_ratio)
        return np.asarray(np.exp(ends * np.cos(2.0 * np.pi * along) - far * np.cos(np.pi * along)))


@dataclass(frozen=True)
class SolidMaterial:
    """An isotropic elastic solid.

    Args:
        density: mass per volume [kg/m3].
        youngs_modulus: E [Pa].
        poisson_ratio: [1]. Values near 0.5 lock coarse meshes; the bending of a slender body hardly
            depends on it.
        damping_time: stiffness-proportional damping, the beta of C = beta K [s].
        friction: Coulomb coefficient against an obstacle of friction 1 [1].
    """

    density: float = 1070.0
    youngs_modulus: float = 250e3
    poisson_ratio: float = 0.3
    damping_time: float = 0.0
    friction: float = 0.5

    kind: ClassVar[str] = "solid"

    def __post_init__(self) -> None:
        _check(self)


Material: TypeAlias = ClothMaterial | RopeMaterial | SolidMaterial

MATERIALS: dict[str, type[ClothMaterial] | type[RopeMaterial] | type[SolidMaterial]] = {
    "cloth": ClothMaterial,
    "rope": RopeMaterial,
    "solid": SolidMaterial,
}

#: What a study infers when it says nothing else: the material fields with wide, physical priors.
#: Cloth: the ten fabrics of Wang, O'Brien and Ramamoorthi (2011), widened. Rope: from yarn-soft lines to
#: jacketed cables of a few millimetres. Solid: soft silicones.
DEFAULT_PRIORS: dict[str, tuple[Parameter, ...]] = {
    "cloth": (
        Parameter("stretch_stiffness", "N/m", 30.0, 3000.0, "log", "Young's modulus times thickness"),
        Parameter("bending_rigidity", "N m", 2e-6, 5e-4, "log", "moment per length and curvature"),
    ),
    "rope": (
        Parameter("bending_rigidity", "N m2", 1e-6, 1e-2, "log", "moment per curvature"),
        Parameter("stretch_stiffness", "N", 50.0, 5000.0, "log", "Young's modulus times cross-section"),
    ),
    "solid": (Parameter("youngs_modulus", "Pa", 5e4, 1.5e6, "log", "Young's modulus"),),
}

_SHARED_UNITS = {"damping_time": "s", "friction": "1", "scale": "1"}
#: Unit of every material field, and of the object's scale, by kind of object.
UNITS: dict[str, dict[str, str]] = {
    "cloth": {
        "areal_density": "kg/m2",
        "stretch_stiffness": "N/m",
        "bending_rigidity": "N m",
        "poisson_ratio": "1",
        "weft_stretch_ratio": "1",
        "weft_bending_ratio": "1",
        **_SHARED_UNITS,
    },
    "rope": {
        "linear_density": "kg/m",
        "stretch_stiffness": "N",
        "bending_rigidity": "N m2",
        "twist_rigidity": "N m2",
        "diameter": "m",
        "end_bending_ratio": "1",
        "far_bending_ratio": "1",
        **_SHARED_UNITS,
    },
    "solid": {"density": "kg/m3", "youngs_modulus": "Pa", "poisson_ratio": "1", **_SHARED_UNITS},
}

#: Between what and what a field lies whatever the object, and how a number in a unit that is usual elsewhere reads.
_LIMITS = {
    "areal_density": (0.0, 20.0, "150 g/m2 are 0.15"),
    "linear_density": (0.0, 20.0, "50 g/m are 0.05"),
    "density": (3.0, 3e4, "1.07 g/cm3 are 1070"),
    "diameter": (0.0, 0.5, "8 mm are 0.008"),
}


def check_meant(kind: str, name: str, value: float) -> None:
    """Raise :class:`InputError` if no object of this ``kind`` has such a value, which is then in another unit."""
    low, high, other = _LIMITS.get(name, (-float("inf"), float("inf"), ""))
    if not low <= value <= high:
        raise InputError(
            f"{name} is in {UNITS[kind][name]} and must lie between {low:g} and {high:g}, but is {value:g}; {other}"
        )


M = TypeVar("M", bound=ClothMaterial | RopeMaterial | SolidMaterial)


def with_fields(material: M, values: dict[str, float]) -> M:
    """A copy of ``material`` with some fields replaced; an unknown field is an :class:`InputError`."""
    known = [f.name for f in fields(material)]
    for name in values:
        if name not in known:
            raise InputError(f"a {material.kind} material has no {name!r}; it has {', '.join(known)}")
    return replace(material, **cast(Any, values))
