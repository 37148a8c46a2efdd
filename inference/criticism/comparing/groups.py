"""Every compared number sorted by recording, by what the object did, and by where on the object it was."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ....core.arrays import FloatArray, IntArray
from .held import Held
from .parts import DISTANCES, PLACES, distance_labels, place_labels
from .phases import CONTACT, MOTION, contact_labels, motion_labels, motion_limits, speeds


@dataclass(frozen=True, eq=False)
class Partition:
    """One way to sort all numbers.

    Args:
        title: of the partition: ``recording``, ``phase``, ``contact``, ``distance`` or ``place``.
        names: of its groups.
        labels: of every recording the group of each measured point at each time ``(T, P)``.
        notes: what a group is, exactly; "" where its name says it.
    """

    title: str
    names: tuple[str, ...]
    labels: tuple[IntArray, ...]
    notes: tuple[str, ...]


def partitions(takes: Sequence[Held]) -> list[Partition]:
    """Those partitions that have more than one group."""
    limits = motion_limits([speeds(h.best, h.scenario) for h in takes])
    notes = (
        f"below {limits[0]:.2g} m/s",
        f"{limits[0]:.2g} to {limits[1]:.2g} m/s",
        f"above {limits[1]:.2g} m/s",
        "falls, and touches nothing",
    )
    found = [
        _partition("recording", [h.name for h in takes], [_every(h, k) for k, h in enumerate(takes)]),
        _partition("phase", MOTION, [_by_frame(h, motion_labels(h.best, h.scenario, limits)) for h in takes], notes),
        _partition("contact", CONTACT, [_by_contact(h) for h in takes], ("within 1 cm of an obstacle", "")),
    ]
    for title, names, labels_of in (("distance", DISTANCES, distance_labels), ("place", PLACES, place_labels)):
        labels = [labels_of(h.scenario) for h in takes]
        known = [x for x in labels if x is not None]
        if len(known) == len(takes):
            found.append(_partition(title, names, [h.of_partner(x) for x, h in zip(known, takes, strict=True)]))
    return [p for p in found if p is not None]


def motion_of(takes: Sequence[Held]) -> list[IntArray]:
    """Index into :data:`~.phases.MOTION` of every frame ``(T,)`` of every recording."""
    limits = motion_limits([speeds(h.best, h.scenario) for h in takes])
    return [motion_labels(h.best, h.scenario, limits) for h in takes]


def _every(held: Held, group: int) -> IntArray:
    return np.full(held.partner.shape, group)


def _by_frame(held: Held, labels: IntArray) -> IntArray:
    return np.repeat(labels[:, None], held.partner.shape[1], axis=1)


def _by_contact(held: Held) -> IntArray:
    """A marker touches something where the vertices that carry it do, by weight; other points as their vertex does."""
    labels = contact_labels(held.best, held.scenario)
    if not held.marked:
        return held.of_partner(labels)
    touching = labels == 0
    carried: FloatArray = touching @ np.abs(held.scenario.markers).T
    whole = np.abs(held.scenario.markers).sum(axis=1)
    points = np.where(carried >= 0.5 * whole, 0, 1)
    return np.asarray(np.take_along_axis(points, held.partner, axis=1))


def _partition(
    title: str, names: Sequence[str], labels: Sequence[IntArray], notes: Sequence[str] = ()
) -> Partition | None:
    """With only those groups that something is in; None if that is one."""
    used = np.unique(np.concatenate([x.ravel() for x in labels]))
    if len(used) < 2:
        return None
    number = np.full(len(names), -1)
    number[used] = np.arange(len(used))
    kept_notes = tuple(notes[k] if notes else "" for k in used)
    return Partition(title, tuple(names[k] for k in used), tuple(number[x] for x in labels), kept_notes)
