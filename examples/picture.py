"""The picture of the README, from what ``make demo`` left in ``demo/``: ``python examples/picture.py``."""

from pathlib import Path

from muslin import Study
from muslin.cli.report import overview_figure

ROOT = Path(__file__).resolve().parent.parent
FOLDER = ROOT / "demo/hidden_effect"


def main() -> None:
    picture = overview_figure(Study.load(FOLDER / "study.toml"), Study.load(FOLDER / "study2.toml"))
    target = ROOT / "docs/overview.png"
    target.parent.mkdir(exist_ok=True)
    target.write_bytes(picture)
    print(f"wrote {target}")


if __name__ == "__main__":
    main()
