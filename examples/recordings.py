"""Published recordings, from the file to the report: import, fit, compare, diagnose, add what is named, report.

Runs the commands that a user would type, in ``demo/SET/`` or the folder given, and prints each before it runs::

    python examples/recordings.py balls                 # in the repository, as the beam
    python examples/recordings.py carried_cloth         # needs MUSLIN_DATA, see the README of the set
    python examples/recordings.py balls --study tennis.toml
"""

import argparse
import os
import shutil
import sys
import tomllib
from pathlib import Path

from demo import DEMO, ROOT, import_beam, muslin, study, title

#: Of every set: the reader, where the recordings are, and the study that is run if no other is asked for. Those not in
#: the repository are below the folder ``MUSLIN_DATA``.
SETS = {
    "balls": ("balls", ROOT / "examples/balls/drops.csv", "whiffle.toml"),
    "beam": ("", ROOT / "examples/beam/data", "study.toml"),
    "cable": ("deform-cable", Path("cable/cable1.npz"), "study.toml"),
    "carried_cloth": ("carried-cloth", Path("cloth_carried"), "study.toml"),
    "cloth_cloud": ("cloth-cloud", Path("cloth_cloud"), "lift.toml"),
}


def located(path: Path) -> Path:
    """Where the recordings are; ends the program with what to do if they are not there."""
    folder = os.environ.get("MUSLIN_DATA", "")
    found = path if path.is_absolute() else Path(folder).expanduser().absolute() / path
    if not path.is_absolute() and not folder:
        sys.exit(
            f"{path} is not in the repository; set MUSLIN_DATA to the folder that it is in (see the README beside)"
        )
    if not found.exists():
        sys.exit(f"there is no {found}; set MUSLIN_DATA to the folder that {path} is in (see the README beside)")
    return found


def run(name: str, chosen: str | None, folder: Path) -> Path:
    """All commands of one set, in a new ``folder``; the path of the report."""
    dataset, path, usual = SETS[name]
    own = ROOT / "examples" / name
    if not (own / (chosen or usual)).is_file():
        sys.exit(f"there is no {chosen} in {own}; there are {', '.join(sorted(p.name for p in own.glob('*.toml')))}")
    source = located(path)
    if folder.exists():
        sys.exit(f"{folder} is there already; remove it, or name another folder with -o")
    folder.mkdir(parents=True)
    for mesh in (*own.glob("*.vtk"), *own.glob("*.obj")):
        shutil.copy(mesh, folder)
    shutil.copy(own / (chosen or usual), folder / "study.toml")
    table = tomllib.loads((folder / "study.toml").read_text())["study"]
    title(f"{name}, {chosen or usual}")
    if name == "beam":
        import_beam(folder)
    else:
        takes = [t for take in (*table["fit_on"], *table["hold_out"]) for t in ("--take", take)]
        muslin(folder, "import", str(source), "--dataset", dataset, "-o", table["measurement"], *takes)
    return study(folder)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("set", choices=list(SETS))
    parser.add_argument("--study", help="another study file of the set")
    parser.add_argument("-o", "--output", type=Path, help="a new folder (default: demo/SET)")
    a = parser.parse_args()
    print(f"\nThe report: {run(a.set, a.study, (a.output or DEMO / a.set).absolute())}")


if __name__ == "__main__":
    main()
