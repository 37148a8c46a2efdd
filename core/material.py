"""Materials in SI. The same numbers mean the same object on every backend."""

from dataclasses import dataclass, fields, replace
from typing import Any, ClassVar, TypeAlias, TypeVar, cast

from .errors import InputError
from .parameters import Parameter


def _check(material: "Material") -> None:
    for f in fields(material):
        value = getattr(material, f.name)
        if not value >= 0 or value == float("inf"):
            raise InputError(f"material: {f.name} must be finite and not negative, but is {value!r}")
    for name in ("areal_density", "density", "stretch_stiffness", "youngs_modulus"):
        if getattr(material, name, 1.0) <= 0:
            raise InputError(f"material: {name} must be above zero, but is {getattr(material, name)!r}")
    if material.poisson_ratio >= 0.5:
        raise InputError(f"material: poisson_ratio must be below 0.5, but is {material.poisson_ratio:g}")


@dataclass(frozen=True)
class ClothMaterial:
    """A thin sheet, isotropic.

    Args:
        areal_density: mass per area [kg/m2].
        stretch_stiffness: Young's modulus times thickness, E t [N/m].
        bending_rigidity: D [N m], moment per length and curvature.
        poisson_ratio: in-plane [1].
        damping_time: stiffness-proportional damping, the beta of C = beta K [s].
        friction: Coulomb coefficient against the table [1].
    """

    areal_density: float = 0.15
    stretch_stiffness: float = 300.0
    bending_rigidity: float = 2e-5
    poisson_ratio: float = 0.3
    damping_time: float = 0.0
    friction: float = 0.3

    kind: ClassVar[str] = "cloth"

    def __post_init__(self) -> None:
        _check(self)

    @property
    def density(self) -> float:
        """Mass per measure of an element (area) [kg/m2]."""
        return self.areal_density


@dataclass(frozen=True)
class SolidMaterial:
    """An isotropic elastic solid.

    Args:
        density: mass per volume [kg/m3].
        youngs_modulus: E [Pa].
        poisson_ratio: [1]. Values near 0.5 lock coarse meshes; the bending of a slender body hardly
            depends on it.
        damping_time: stiffness-proportional damping, the beta of C = beta K [s].
        friction: Coulomb coefficient against the table [1].
    """

    density: float = 1070.0
    youngs_modulus: float = 250e3
    poisson_ratio: float = 0.3
    damping_time: float = 0.0
    friction: float = 0.5

    kind: ClassVar[str] = "solid"

    def __post_init__(self) -> None:
        _check(self)


Material: TypeAlias = ClothMaterial | SolidMaterial

MATERIALS: dict[str, type[ClothMaterial] | type[SolidMaterial]] = {
    "cloth": ClothMaterial,
    "solid": SolidMaterial,
}

#: What a study infers when it says nothing else: the material fields with wide, physical priors.
#: Cloth: the ten fabrics of Wang, O'Brien and Ramamoorthi (2011), widened. Solid: soft silicones.
DEFAULT_PRIORS: dict[str, tuple[Parameter, ...]] = {
    "cloth": (
        Parameter("stretch_stiffness", "N/m", 30.0, 3000.0, "log", "Young's modulus times thickness"),
        Parameter("bending_rigidity", "N m", 2e-6, 5e-4, "log", "moment per length and curvature"),
    ),
    "solid": (Parameter("youngs_modulus", "Pa", 5e4, 1.5e6, "log", "Young's modulus"),),
}

UNITS = {
    "areal_density": "kg/m2",
    "density": "kg/m3",
    "stretch_stiffness": "N/m",
    "bending_rigidity": "N m",
    "youngs_modulus": "Pa",
    "poisson_ratio": "1",
    "damping_time": "s",
    "friction": "1",
    "scale": "1",
}


M = TypeVar("M", bound=ClothMaterial | SolidMaterial)


def with_fields(material: M, values: dict[str, float]) -> M:
    """A copy of ``material`` with some fields replaced; an unknown field is an :class:`InputError`."""
    known = [f.name for f in fields(material)]
    for name in values:
        if name not in known:
            raise InputError(f"a {material.kind} material has no {name!r}; it has {', '.join(known)}")
    return replace(material, **cast(Any, values))
