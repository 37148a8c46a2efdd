"""Which cases there are: dealt from seeds, so that whatever comes first is a fair share of the whole."""

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Generic, TypeVar

import numpy as np

from .outside import LAWS, UNKNOWN
from .settings import SETTINGS

#: Seeds of the first case: those that methods may be improved on, and those that judge them.
FIRST_SEEDS = {"development": 1000, "test": 1_000_000}
#: Kinds of hidden truth in every twenty cases.
#: ``none``: nothing. ``known``: one effect of the library. ``unknown``: one outside it. ``two``: two of the library.
#: ``law``: a known kind of effect under another law. ``tied``: one that a look-alike explains as well.
#: ``poor``: an effect, or nothing, in data that would not show most effects.
BLOCK = {"none": 6, "known": 6, "unknown": 4, "two": 1, "law": 1, "tied": 1, "poor": 1}
#: Each setting as often as it is here.
SETTING_DECK = ("rope-air", "rope-cable", "rope-table", "cloth-air", "cloth-table", "cloth-table")
#: Who plays reality: the model's own engine, the same on a mesh and a step half as large, or the other engine.
SOURCE_DECK = ("same",) * 5 + ("finer",) * 2 + ("other",) * 3
NOISE_DECK = (0.001, 0.002, 0.003, 0.005)  # standard deviations [m]
#: AR(1) coefficient of the noise that is correlated, and the share of what a dropout hides.
CORRELATION, DROPOUT = 0.8, 0.1
#: Effects of which one explains what another does where the object hardly moves, by setting.
LOOK_ALIKES: dict[str, tuple[tuple[str, str], ...]] = {
    "rope-air": (("gravity-tilt", "wind"), ("wind", "gravity-tilt"), ("actuator-lag", "camera-latency")),
    "rope-cable": (("wind", "gravity-tilt"), ("gravity-tilt", "wind"), ("actuator-lag", "camera-latency")),
    "rope-table": (("gravity-tilt", "table-tilt"), ("actuator-lag", "camera-latency")),
    "cloth-air": (("gravity-tilt", "wind"), ("wind", "gravity-tilt"), ("camera-latency", "actuator-lag")),
    "cloth-table": (("actuator-lag", "camera-latency"), ("camera-latency", "actuator-lag")),
}

T = TypeVar("T")


@dataclass(frozen=True)
class Case:
    """One case, before anything is simulated.

    Args:
        seed: of everything in it.
        kind: of truth, see :data:`BLOCK`.
        setting: name, see :data:`~.settings.SETTINGS`.
        role: of the motions, see :class:`~.settings.Setting`.
        source: see :data:`SOURCE_DECK`.
        noise: standard deviation [m].
        correlated: whether the noise is, see :data:`CORRELATION`.
        dropouts: whether markers are lost at times.
        strength: ``"weak"`` or ``"strong"``.
        markers: how many; None: all of the setting.
        offers: what may be hidden, the first that shows as much as it shall; of the kind ``two``, the pairs.
    """

    seed: int
    kind: str
    setting: str
    role: str
    source: str
    noise: float
    correlated: bool
    dropouts: bool
    strength: str
    markers: int | None
    offers: tuple[tuple[str, ...], ...]

    def as_dict(self) -> dict[str, Any]:
        return {**asdict(self), "offers": [list(o) for o in self.offers]}


class Deck(Generic[T]):
    """Deals the same cards again and again, shuffled anew each time."""

    def __init__(self, cards: Sequence[T], rng: np.random.Generator) -> None:
        self._cards, self._rng, self._left = list(cards), rng, list[T]()

    def deal(self) -> T:
        if not self._left:
            self._left = [self._cards[k] for k in self._rng.permutation(len(self._cards))]
        return self._left.pop()


def plan(first: int) -> Iterator[Case]:
    """The cases from a first seed on, without end; the same ones in the same order every time."""
    rng = np.random.default_rng([first, 61])
    dealers = {kind: _Dealer(kind, np.random.default_rng([first, 62, k])) for k, kind in enumerate(BLOCK)}
    seeds = itertools.count(first)
    while True:
        # every kind at its own even spacing, so that any first part of the block has its share of each
        places = [((j + rng.random()) / count, kind) for kind, count in BLOCK.items() for j in range(count)]
        for _, kind in sorted(places):
            yield dealers[kind].case(next(seeds))


class _Dealer:
    """Deals the cases of one kind."""

    def __init__(self, kind: str, rng: np.random.Generator) -> None:
        self.kind = kind
        self._rng = rng
        self._settings, self._sources = Deck(SETTING_DECK, rng), Deck(SOURCE_DECK, rng)
        self._noises, self._roles = Deck(NOISE_DECK, rng), Deck(("a", "b"), rng)
        self._flaws = Deck([(c, d) for c in (False, True) for d in (False, True)], rng)
        self._strengths, self._something = Deck(("weak", "strong"), rng), Deck((True, True, False), rng)
        self._effects = {name: Deck(s.effects, rng) for name, s in SETTINGS.items()}
        self._others = Deck(tuple(LAWS) if kind == "law" else tuple(UNKNOWN), rng)
        self._pairs = {name: Deck(pairs, rng) for name, pairs in LOOK_ALIKES.items()}

    def case(self, seed: int) -> Case:
        setting, (correlated, dropouts) = self._settings.deal(), self._flaws.deal()
        case = Case(
            seed=seed,
            kind=self.kind,
            setting=setting,
            role=self._roles.deal(),
            source=self._sources.deal(),
            noise=self._noises.deal(),
            correlated=correlated,
            dropouts=dropouts,
            strength=self._strengths.deal(),
            markers=None,
            offers=(),
        )
        fields = case.__dict__ | {"offers": self._offers(setting)}
        if self.kind in ("tied", "poor"):
            # what is told apart is a matter of the data alone, so the model can play reality exactly
            poor = self.kind == "poor"
            role = ("still" if case.role == "a" else "slow") if poor else "slow"
            fields |= {"role": role, "source": "same", "noise": 0.005 if poor else max(case.noise, 0.003), "markers": 5}
            fields |= {"correlated": False, "dropouts": False}
        return Case(**fields)

    def _offers(self, setting: str) -> tuple[tuple[str, ...], ...]:
        if self.kind == "none" or (self.kind == "poor" and not self._something.deal()):
            return ()
        if self.kind == "tied":
            first = self._pairs[setting].deal()
            return (first, *(p for p in LOOK_ALIKES[setting] if p != first))
        if self.kind in ("unknown", "law"):
            first_other, pool = self._others.deal(), tuple(LAWS) if self.kind == "law" else tuple(UNKNOWN)
            return ((first_other,), *((o,) for o in self._shuffled(pool) if o != first_other))
        first_effect = self._effects[setting].deal()
        rest = [e for e in self._shuffled(SETTINGS[setting].effects) if e != first_effect]
        if self.kind == "two":  # where the first one cannot show, others must be able to
            return tuple(itertools.combinations((first_effect, *rest), 2))
        return ((first_effect,), *((e,) for e in rest))

    def _shuffled(self, names: Sequence[str]) -> list[str]:
        return [names[k] for k in self._rng.permutation(len(names))]
