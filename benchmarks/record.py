"""What a benchmark found, as JSON: `results/benchmarks/NAME.json`; and `make benchmark-check`, which compares
the ratios there with those that are stored beside this file.

A ratio is how many times as long a peer takes, or an older way; times are of one machine, ratios travel.

    python benchmarks/record.py [--store]
"""

import argparse
import json
import sys
from pathlib import Path

FOUND = Path(__file__).parents[1] / "results" / "benchmarks"
STORED = Path(__file__).with_name("stored.json")
# Ratios scatter by a fifth on an idle machine, more on others.
MARGIN = 1.5


def record(name: str, header: str, ratios: dict[str, float], rows: list) -> None:
    """`rows`: what the table shows. Written whole or not at all."""
    FOUND.mkdir(parents=True, exist_ok=True)
    file = FOUND / f"{name}.json"
    fresh = file.with_suffix(".new")
    told = {"machine": header, "ratios": ratios, "rows": rows}
    fresh.write_text(json.dumps(told, indent=1, default=float) + "\n")
    fresh.replace(file)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--store", action="store_true", help="keep what was found as the new mark")
    store = parser.parse_args().store
    files = sorted(FOUND.glob("*.json"))
    if not files:
        print("nothing was measured yet: make benchmark", file=sys.stderr)
        return 2
    found = {file.stem: json.loads(file.read_text())["ratios"] for file in files}
    stored = json.loads(STORED.read_text()) if STORED.exists() else {}
    if store:
        STORED.write_text(json.dumps({**stored, **found}, indent=1, sort_keys=True) + "\n")
        return 0
    worse = 0
    print(f"{'':60}{'stored':>9}{'now':>9}")
    for name, ratios in found.items():
        for what, now in ratios.items():
            before = stored.get(name, {}).get(what)
            slower = before is not None and now * MARGIN < before
            worse += slower
            shown = "" if before is None else f"{before:.2f}"
            print(f"{name + ': ' + what:60}{shown:>9}{now:9.2f}{'  SLOWER' if slower else ''}")
    return 1 if worse else 0


if __name__ == "__main__":
    sys.exit(main())
