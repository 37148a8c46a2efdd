"""What extractors share that learn a network: its weights, their file, and the device on which it runs."""

from abc import abstractmethod
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

import torch
from torch import nn

from ..core.errors import InputError, StepMissingError
from ..core.extractor import KeypointExtractor
from .weights import Arrays, load_weights, save_weights


class LearnedExtractor(KeypointExtractor):
    """An extractor with a network, which looks at images.

    Weights are kept as arrays, so that it travels to worker processes and runs on whatever device is there.

    Args:
        weights: file that :meth:`save` wrote; empty: it must learn first.
        device: ``"auto"`` (a GPU where there is one), ``"cpu"`` or ``"cuda"``.

    Raises:
        InputError: no such device, or a file that does not describe this extractor.
        MissingFileError: no such file of weights.
    """

    needs_images: ClassVar[bool] = True
    #: What the description of its weights must hold.
    described: ClassVar[tuple[str, ...]] = ()

    def __init__(self, weights: str | Path, device: str) -> None:
        self.device = device
        self._device()
        self._arrays: Arrays = {}
        self._about: dict[str, Any] = {}
        if weights:
            self._arrays, self._about = load_weights(Path(weights), self.name)
            missing = [key for key in self.described if key not in self._about]
            if missing or not self._arrays:
                what = f"no {missing[0]}" if missing else "no arrays"
                raise InputError(f"{weights} does not describe a trained {self.name!r} ({what}); train it again")

    @abstractmethod
    def _build(self) -> nn.Module:
        """The network that the description is of, untrained."""

    @property
    def ready(self) -> bool:
        return bool(self._arrays)

    def save(self, path: str | Path) -> None:
        """Write the weights to one ``.safetensors`` file."""
        self._must_have_learned()
        save_weights(Path(path), self.name, self._arrays, self._about)

    def _learned(self, net: nn.Module, about: Mapping[str, Any]) -> None:
        """Keep what was learned, and its description."""
        self._arrays = {name: value.cpu().numpy() for name, value in net.state_dict().items()}
        self._about = dict(about)
        self.__dict__.pop("_net", None)

    @cached_property
    def _net(self) -> Any:
        net = self._build()
        try:
            net.load_state_dict({name: torch.from_numpy(value.copy()) for name, value in self._arrays.items()})
        except RuntimeError as error:  # of arrays that are missing, too many, or of another shape
            reason = str(error).splitlines()[-1].strip()
            raise InputError(f"these weights are not of this {self.name!r}: {reason} Train it again") from error
        return net.eval().to(self._device())

    def __getstate__(self) -> dict[str, Any]:
        return {k: v for k, v in self.__dict__.items() if k != "_net"}

    def _must_have_learned(self) -> None:
        if not self.ready:
            raise StepMissingError(
                f"extractor {self.name!r} has not learned yet; train it with: muslin train {self.name} VIDEO.zarr "
                "-o FILE.safetensors, and give it that file as weights"
            )

    def _device(self) -> torch.device:
        if self.device not in ("auto", "cpu", "cuda"):
            raise InputError(f"device must be 'auto', 'cpu' or 'cuda', not {self.device!r}")
        if self.device == "cuda" and not torch.cuda.is_available():
            raise InputError("device is 'cuda', but torch finds no GPU here; use device = 'auto' or 'cpu'")
        return torch.device("cuda" if self.device != "cpu" and torch.cuda.is_available() else "cpu")
