"""Where an object that starts as it was seen really starts, for what effects make of what is told and seen."""

from collections.abc import Sequence
from dataclasses import replace

from .arrays import FloatArray
from .effect import Effect
from .motion import Motion, inverse, rotate
from .scenario import Scenario, StartMotion
from .scenarios.starts import GivenShape


def really_starting(scenario: Scenario, told: Motion, seen: FloatArray, effects: Sequence[Effect]) -> Scenario:
    """The scenario of an object in motion, which starts where the first frame really was, at the time when it was so.

    What was seen stays where it was, wherever the grippers have really got to by then, and is held by them as it
    lies in them there; a frame that is late shows where the object was before; and what a camera adds is taken off.

    Args:
        scenario: whose grippers move as they really do.
        told: the motion that they were told, in whose frame the start is given.
        seen: when the object really was as it was seen ``(T,)`` [s].
        effects: what of them acts on points is undone, the last one first.
    """
    start, motion = scenario.start, scenario.start_motion
    if not isinstance(start, GivenShape) or motion is None:
        return scenario
    moved = [e for e in effects if type(e).off_points is not Effect.off_points]
    if scenario.motion is told and seen is scenario.times and not moved:
        return scenario
    was, now = told.at(scenario.times[:1])[0, 0], scenario.motion.at(seen[:1])[0, 0]
    first = scenario.markers @ replace(scenario, motion=told).start_vertices()
    shape, about = (rotate(was[3:], x) + was[:3] for x in (start.vertices, start.about))
    velocities, accelerations, earlier = motion.velocities, motion.accelerations, scenario.earlier
    for effect in reversed(moved):
        centre = first.mean(axis=0)
        there = effect.off_points(centre, first)
        velocities, accelerations = (effect.off_points(centre + v, first) - there for v in (velocities, accelerations))
        shape, about = effect.off_points(shape, first), effect.off_points(about, first)
        earlier = None if earlier is None else effect.off_points(earlier, first)
        first = effect.off_points(first, first)
    shape, about = (rotate(inverse(now[3:]), x - now[:3]) for x in (shape, about))
    return replace(
        scenario,
        times=seen,
        start=replace(start, vertices=shape, about=about),
        start_motion=StartMotion(velocities, accelerations),
        earlier=earlier,
    )
