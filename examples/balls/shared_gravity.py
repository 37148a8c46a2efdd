"""Five balls, one gravity: do their falls agree on how strong it is, under a linear and under a quadratic law of drag?

Every ball keeps a drag of its own; gravity is inferred beside it, from the first drop, and what the five tell is held
together. Runs the commands that a user would type, in ``demo/shared_gravity``, and prints each before it runs; four
minutes on two cores::

    python examples/balls/shared_gravity.py
"""

import shutil
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from demo import DEMO, muslin, title

HERE = Path(__file__).resolve().parent
BALLS = ("bowling", "golf", "tennis", "volleyball", "whiffle")
LAWS = ("viscous-damping", "air-drag")
#: Of a round. A study of a ball has 20, which is little for gravity beside drag.
DRAWS = 100
#: Wide enough for all falls under either law of drag.
GRAVITY = """
[effects.gravity-strength.excess]  # beyond 9.80665 m/s2
low = -6.0
high = 6.0
"""


def fitted(ball: str, law: str, folder: Path) -> str:
    """Name of the study of one ball with gravity and one law of drag inferred, fitted."""
    text = (HERE / f"{ball}.toml").read_text().replace("draws = 20", f"draws = {DRAWS}")
    (folder / f"{ball}.toml").write_text(text + GRAVITY)
    shutil.copy(HERE / f"{ball}.vtk", folder)
    name = f"{law}-{ball}.toml"
    muslin(folder, "add", law, f"{ball}.toml", "-o", name)
    muslin(folder, "fit", name)
    return name


def main() -> None:
    folder = DEMO / "shared_gravity"
    if folder.exists():
        sys.exit(f"{folder} is there already; remove it first")
    folder.mkdir(parents=True)
    muslin(folder, "import", str(HERE / "drops.csv"), "--dataset", "balls", "-o", "balls.zarr")
    studies = {law: [fitted(ball, law, folder) for ball in BALLS] for law in LAWS}
    for law, names in studies.items():
        title(f"together, with {law}")
        muslin(folder, "combine", *names, "--parameter", "gravity-strength.excess", "--json", f"{law}.json")


if __name__ == "__main__":
    main()
