"""What a virtual test is: cases, each with what is asked and how it is measured on one mesh."""

from collections.abc import Callable
from dataclasses import dataclass

from .lab import Lab

#: Largest relative error that is within the goal, by group of tests.
GOALS = {"stretch": 0.05, "bending": 0.10, "friction": 0.05, "sag": 0.05, "period": 0.05, "twist": 0.10, "fall": 0.05}


@dataclass(frozen=True)
class Asked:
    """A quantity, and what its closed form or the material says it is.

    Args:
        quantity: its name.
        unit: in which it is given.
        value: asked; None where there is no closed form, and the measured value is only reported.
        goal: largest error: relative, or in ``unit`` where ``value`` is zero; None: only reported.
    """

    quantity: str
    unit: str
    value: float | None = None
    goal: float | None = None


@dataclass(frozen=True)
class Case:
    """One object of one material, measured on meshes of rising fineness.

    Args:
        kind: of body.
        label: what is special about it.
        asked: the quantities that ``measure`` gives, in this order.
        meshes: numbers of cells, rising; :attr:`VirtualTest.cells` says of what.
        measure: runs the test on one mesh.
        needs: capabilities beyond those that its scenes show.
    """

    kind: str
    label: str
    asked: tuple[Asked, ...]
    meshes: tuple[int, ...]
    measure: Callable[[Lab, int], tuple[float, ...]]
    needs: frozenset[str] = frozenset()


@dataclass(frozen=True)
class VirtualTest:
    """One test of the bench.

    Args:
        name: as given to ``--test``.
        group: of :data:`GOALS`, or another where nothing has a goal; one summary is made for each.
        cells: what the mesh counts are.
        cases: makes the cases; few and coarse if ``quick``.
    """

    name: str
    group: str
    cells: str
    cases: Callable[[bool], tuple[Case, ...]]
