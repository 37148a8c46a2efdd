"""A bend that a rope keeps where nothing acts on it."""

from typing import ClassVar

import numpy as np

from ...core.arrays import FloatArray
from ...core.body import Body
from ...core.effect import Effect
from ...core.material import Material, RopeMaterial
from ...core.parameters import Parameter
from ...core.scenario import Scenario
from ...core.scenarios.kept import bent


class RestCurvature(Effect):
    """Natural curvature of a rope that its model takes to be straight, told by the states that it was seen in.

    In every state the bending moments are in balance with weight, inertia and tension, and the curvature that they do
    not account for is the rope's own: :func:`~muslin.core.kept_bend.kept_in`. It turns with the material and is the
    same in all recordings, so states all along those that are fitted tell it together:
    :func:`~muslin.core.scenarios.kept.told_bend`. The simulator is given a rope that is bent by ``share`` times that
    where nothing acts on it: 1 is in balance in the mean.

    What hardly any state tells is a bend that is even along a rope between two clamps, as that of a spool on which it
    was stored: the clamps give how much the rope turns in all, so as long as it stays in one plane such a bend changes
    neither its shape nor its energy. How it moves out of that plane does tell. So that part has coefficients of its
    own, which come on top; where a rope is not as stiff everywhere, it is the moment of that bend that is even.

    References:
        Twigg and Kacic-Alesic, *Optimization for sag-free simulations*, 2011; Derouet-Jourdan et al., *Stable
        inverse dynamic curves*, 2010, for rods; the accelerations and what states tell together are added here.
    """

    name: ClassVar[str] = "rest-curvature"
    acts_on: ClassVar[str] = "material"
    object_kinds: ClassVar[frozenset[str]] = frozenset({"rope"})
    needs: ClassVar[frozenset[str]] = frozenset({"curved-rest"})
    needs_kept_bend: ClassVar[bool] = True
    coefficients: ClassVar[tuple[Parameter, ...]] = (
        Parameter("share", "1", 0.0, 1.5, description="of the curvature that is in balance with what was seen"),
        Parameter("even_about_z", "1/m", -5.0, 5.0, description="even curvature about the first gripper's z axis"),
        Parameter("even_about_side", "1/m", -5.0, 5.0, description="that about the axis across the rope and z"),
    )
    symptom: ClassVar[str] = "straightens in the model where the real one keeps a bend"

    def on_body(self, scenario: Scenario, material: Material, gravity: FloatArray) -> Body:
        if scenario.kept is None or not isinstance(material, RopeMaterial):
            return scenario.body
        even = np.array([self.values["even_about_z"], self.values["even_about_side"]])
        even = even / material.bending_shares(scenario.kept.along)[:, None]
        return bent(scenario, self.values["share"] * scenario.kept.curvature(material, gravity) + even)
