#!/usr/bin/env python3
"""Give the program damaged and hostile input at random, and say where it neither takes nor refuses it as it should.

    PYTHONPATH=src .venv/bin/python scripts/fuzz.py --scenes 500 --files 1000 --commands 200 --kills 50 -o fuzz.json
    PYTHONPATH=src .venv/bin/python scripts/fuzz.py --only files:17 --seed 3

Scenes are mutated by what the models allow, and as text; each must be accepted, and then drawn, or refused in
sentences. Files of every kind that is read have their bytes mutated. Commands get options at random. Runs of the
command are ended by signals at random moments. A case depends on the seed, its kind and its number alone, and runs in
a process whose time and memory are watched. Results are counts by outcome, and each finding with its input.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import sys
import tempfile
from collections import Counter
from pathlib import Path
from typing import Any

SCRIPT = Path(__file__).resolve()
sys.path.insert(0, str(SCRIPT.parent))

from fuzzing.workers import KINDS, Worker, work  # noqa: E402


def main() -> None:
    """Run the cases that are asked for; leave with 1 where there are findings."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    for kind in KINDS:
        parser.add_argument(f"--{kind}", type=int, default=0, metavar="N", help=f"how many cases of {kind}")
    parser.add_argument("--first", type=int, default=0, metavar="N", help="number of the first case of each kind")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", metavar="KIND:N", help="run one case, print its input, and keep its folder")
    parser.add_argument("-o", "--output", type=Path, metavar="FILE", help="where to write the results, as JSON")
    parser.add_argument("--worker", type=int, help=argparse.SUPPRESS)
    options = parser.parse_args()
    os.environ.setdefault("GREENSWARD_DEVICE", "cpu")
    if options.worker is not None:
        work(options.worker)
        return
    if options.only:
        _show(options.only, options.seed)
        return
    asked = [(kind, options.first + k) for kind in KINDS for k in range(getattr(options, kind))]
    results = _run(asked, options.seed, options.output)
    for kind, counts in results["counts"].items():
        print(f"{kind}: {', '.join(f'{count} {outcome}' for outcome, count in sorted(counts.items()))}")
    sys.exit(1 if results["findings"] else 0)


def _run(asked: list[tuple[str, int]], seed: int, output: Path | None) -> dict[str, Any]:
    """The results of these cases, which are also written after each finding."""
    counts: dict[str, Counter[str]] = {}
    findings: list[dict[str, Any]] = []
    results = {"seed": seed, "counts": counts, "slowest": {}, "findings": findings}
    slowest: dict[str, Any] = {}
    with Worker(SCRIPT) as worker:
        for kind, number in asked:
            case = worker.run(kind, number, seed)
            counts.setdefault(kind, Counter())[case["outcome"]] += 1
            if case["seconds"] > slowest.get(kind, {"seconds": 0.0})["seconds"]:
                slowest[kind] = {"case": f"{kind}:{number}", "seconds": case["seconds"]}
            if case["outcome"] == "finding":
                findings.append({"case": f"{kind}:{number}", "seen": case["seen"], "input": case["input"]})
                print(f"{kind}:{number}: {case['seen']}", flush=True)
                print(f"    {' | '.join(case['input'])}"[:2000].replace("\n", "\n    "), flush=True)
                print(f"    again: {_again(kind, number, seed)}", flush=True)
            results["slowest"] = slowest
            if output and (case["outcome"] == "finding" or (kind, number) == asked[-1]):
                output.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    return results


def _again(kind: str, number: int, seed: int) -> str:
    return f"scripts/fuzz.py --only {kind}:{number} --seed {seed}"


def _show(only: str, seed: int) -> None:
    """Run one case again."""
    match = re.fullmatch(rf"({'|'.join(KINDS)}):(\d+)", only)
    if not match:
        sys.exit(f"--only: must be one of {', '.join(KINDS)}, a colon and a number (got {only})")
    folder = Path(tempfile.mkdtemp(prefix="greensward-case-"))
    with Worker(SCRIPT) as worker:
        case = worker.run(match[1], int(match[2]), seed, keep=folder)
    print("\n".join(case.pop("input")))
    print(json.dumps(case, indent=1))
    print(f"its files: {folder}")


if __name__ == "__main__":
    main()
