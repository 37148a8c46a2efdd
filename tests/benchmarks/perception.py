"""How well keypoints are found in simulated frames; ``results/perception.json``.

One module an extractor, each with a function of the settings; ``--only`` picks some. A smaller run is one with fewer
``--frames``, ``--epochs`` and ``--steps``.
"""

import argparse
import os
import time
from collections.abc import Callable
from dataclasses import replace

from perception_settings import Settings
from table import Row, report, write


def _heatmap(settings: Settings) -> list[Row]:
    from perception_heatmap import rows

    return rows(settings)


def _transporter(settings: Settings) -> list[Row]:
    from perception_transporter import figures

    return figures(settings)


EXTRACTORS: dict[str, Callable[[Settings], list[Row]]] = {"heatmap": _heatmap, "transporter": _transporter}


def main() -> None:
    default = Settings()
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="*", choices=list(EXTRACTORS), default=list(EXTRACTORS))
    parser.add_argument("--scenarios", nargs="*", default=default.scenarios)
    parser.add_argument("--keypoints", nargs="*", type=int, default=default.keypoints, help="of transporter")
    parser.add_argument("--shifts", nargs="*", default=default.shifts, help="measured across engines; of the scenarios")
    for name in ("frames", "draws", "held_out", "held_out_draws", "epochs", "steps", "seed"):
        parser.add_argument(f"--{name.replace('_', '-')}", type=int, default=getattr(default, name))
    parser.add_argument("--focused", nargs="*", default=default.focused, help="scenarios where focus is measured, too")
    parser.add_argument("--focus", type=float, default=default.focus, help="of transporter, there")
    given = vars(parser.parse_args())
    only = given.pop("only")
    settings = Settings(**{k: tuple(v) if isinstance(v, list) else v for k, v in given.items()})
    began = time.monotonic()
    rows: list[Row] = []
    seeds = [settings.seed, settings.seed + 1000]
    for name in only:
        for scenario in settings.scenarios:
            rows += EXTRACTORS[name](replace(settings, scenarios=(scenario,)))
            write("perception", rows, seeds, time.monotonic() - began)
    report("perception", rows, seeds, time.monotonic() - began)


if __name__ == "__main__":
    os.environ.setdefault("OMP_NUM_THREADS", str(len(os.sched_getaffinity(0))))
    main()
