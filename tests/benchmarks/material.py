"""Is the object what its material says? Every virtual test on every simulator, one ``results/material-NAME.json`` each.

The same as ``muslin bench-material --full`` for each of them::

    make bench-material
"""

import argparse
import json

from table import RESULTS

from muslin.core.bench import lines, run_bench
from muslin.core.registry import REGISTRY


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--simulator", nargs="*", default=REGISTRY.names("simulator"), help="default: all")
    parser.add_argument("--quick", action="store_true", help="a part of the grid; nothing is written then")
    arguments = parser.parse_args()
    for name in arguments.simulator:
        report = run_bench(REGISTRY.get("simulator", name)(), quick=arguments.quick)
        print("\n".join(lines(report)), flush=True)
        if not arguments.quick:
            path = RESULTS / f"material-{name}.json"
            path.write_text(json.dumps(report.to_json(), indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
            print(f"wrote {path}\n", flush=True)


if __name__ == "__main__":
    main()
