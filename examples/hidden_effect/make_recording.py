"""Make the measurement of the demo: a cloth flung and swung, with an effect that the fit is not told.

The effect is drawn from the seed as well, so that nobody picked it::

    python examples/hidden_effect/make_recording.py --seed 2026 -o examples/hidden_effect/recording.zarr
"""

import argparse
from pathlib import Path

import numpy as np

from muslin.core.measurement_store import save_measurement
from muslin.core.synthetic import FIRST_EFFECTS, hidden_effect


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=2026, help="draws effect, coefficients, material and noise")
    parser.add_argument("-o", "--output", type=Path, default=Path(__file__).with_name("recording.zarr"))
    arguments = parser.parse_args()
    effect = str(np.random.default_rng([arguments.seed, 6]).choice(FIRST_EFFECTS))
    measurement, hidden = hidden_effect(effect, arguments.seed)
    save_measurement(measurement, arguments.output, hidden=hidden, overwrite=True)
    print(f"wrote {arguments.output}: {', '.join(measurement.names)}")


if __name__ == "__main__":
    main()
