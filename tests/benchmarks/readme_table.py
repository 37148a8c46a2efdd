"""Print the README's table of hidden effects from ``results/hidden-small.json``."""

import json

from table import RESULTS


def main() -> None:
    content = json.loads((RESULTS / "hidden-small.json").read_text())
    rows = {r["figure"]: r["value"] for r in content["rows"]}
    print("| hidden | verdict | held-out error [mm] |\n|---|---|---|")
    for figure, told in rows.items():
        if not figure.endswith(": verdict"):
            continue
        hidden = figure.removeprefix("hidden ").removesuffix(": verdict")
        verdict, effects = told.split(": ")
        says = verdict if effects == "-" else f"{verdict}: `{effects}`"
        before, after = (rows[f"hidden {hidden}: held-out error {when}"] for when in ("before", "after"))
        print(f"| {hidden if hidden == 'none' else f'`{hidden}`'} | {says} | {before:.1f} → {after:.1f} |")


if __name__ == "__main__":
    main()
