"""Is the missing effect named? Each of six built-in effects once, and none: MuJoCo data, MuJoCo as the model.

A 0.3 m cloth of 9 x 9 vertices with 25 markers and 3 mm noise; fitted on a fling and a swing, held out
on a wider fling. Material, coefficients and noise are drawn from the seed of the case::

    make bench-hidden-small
"""

import argparse
import tempfile
import time
from pathlib import Path

from table import Row, report

from muslin.core.measurement_store import save_measurement
from muslin.core.study import Study, read_config, write_config
from muslin.core.synthetic import FIRST_EFFECTS, hidden_effect

STUDY = Path(__file__).resolve().parents[2] / "examples/hidden_effect/study.toml"
FIRST_SEED = 100


def case(effect: str | None, seed: int, folder: Path, workers: int | None) -> tuple[dict[str, object], float]:
    """The JSON of the diagnosis, and the seconds of fit and diagnosis."""
    measurement, hidden = hidden_effect(effect, seed)
    save_measurement(measurement, folder / "recording.zarr", hidden=hidden)
    config = read_config(STUDY)
    config.study.seed = seed
    write_config(config, folder / "study.toml")
    study = Study.load(folder / "study.toml", workers=workers)
    began = time.monotonic()
    study.fit()
    result = study.diagnose().to_json()
    return result, time.monotonic() - began


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=FIRST_SEED, help="of the first case; the others follow")
    parser.add_argument("--workers", type=int, default=None)
    parser.add_argument("--only", nargs="*", help="effects to run, 'none' among them; nothing is written then")
    arguments = parser.parse_args()
    rows: list[Row] = []
    began, right, false_names, total = time.monotonic(), 0, 0, 0
    cases: list[str | None] = [None, *FIRST_EFFECTS]
    for k, effect in enumerate(cases):
        name = effect or "none"
        if arguments.only is not None and name not in arguments.only:
            continue
        with tempfile.TemporaryDirectory() as folder:
            result, seconds = case(effect, arguments.seed + k, Path(folder), arguments.workers)
        named = result["effects"]
        wanted = ("named", [effect]) if effect else ("no-misfit", [])
        good = (result["verdict"], named) == wanted
        error = {k: 1e3 * float(v) for k, v in result["error"].items() if k != "unit"}  # type: ignore[attr-defined]
        total, right = total + 1, right + good
        false_names += effect is None and bool(named)
        told = f"{result['verdict']}: {', '.join(named) or '-'}"  # type: ignore[arg-type]
        rows.append(Row(f"hidden {name}: verdict", told, "", "right", good))
        rows.append(Row(f"hidden {name}: held-out error before", error["before"], "mm"))
        rows.append(Row(f"hidden {name}: held-out error after", error["after"], "mm"))
        rows.append(Row(f"hidden {name}: simulations of the diagnosis", int(result["simulations"]), ""))  # type: ignore[call-overload]
        rows.append(Row(f"hidden {name}: fit and diagnosis", round(seconds, 1), "s"))
        print(
            f"hidden {name:<17} {told:<28} {'right' if good else 'WRONG'}   held-out {error['before']:6.2f} -> "
            f"{error['after']:5.2f} mm, noise {error['noise']:.2f}   {seconds:.0f} s",
            flush=True,
        )
    rows.append(Row("right verdicts", right, f"of {total}", ">= 6", right >= 6))
    rows.append(Row("false names where nothing is hidden", false_names, "", "0", false_names == 0))
    if arguments.only is None:
        seeds = [arguments.seed + k for k in range(len(cases))]
        report("hidden-small", rows, seeds, time.monotonic() - began)


if __name__ == "__main__":
    main()
