"""Where networks are trained: on a graphics processor when there is one and it is wanted."""

import torch

from ...core.errors import InputError

NAMES = ("auto", "cpu", "cuda")


def device_of(name: str) -> torch.device:
    """The device that an option ``device`` names; ``auto`` takes a graphics processor when there is one.

    Results repeat to the bit on the same device; between devices they agree up to rounding.

    Raises:
        InputError: another name, or ``cuda`` where there is none.
    """
    if name not in NAMES:
        raise InputError(f"device must be one of {', '.join(NAMES)}, not {name!r}")
    there = torch.cuda.is_available()
    if name == "cuda" and not there:
        raise InputError('device is "cuda", but torch finds no graphics processor here; use "auto" or "cpu"')
    return torch.device("cuda" if there and name != "cpu" else "cpu")
