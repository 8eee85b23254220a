#!/usr/bin/env python3
"""Give the program damaged and hostile input at random, and say where it neither takes nor refuses it as it should.

    PYTHONPATH=src .venv/bin/python scripts/fuzz.py --scenes 10000 --files 10000 --kills 500 -j 2 -o fuzz.json
    PYTHONPATH=src .venv/bin/python scripts/fuzz.py --only files:17 --seed 3

Scenes are mutated by what the models allow, and as text; each must be accepted, and then drawn, or refused in
sentences. Files of every kind that is read have their bytes mutated. Commands get options at random. Runs of the
command are ended by signals at random moments. A case depends on the seed, its kind and its number alone, and runs in
a process whose time and memory are watched. Results are counts by outcome, and each finding with its input. Those of
several runs, also on other machines, are added up by `--add`; docs/safety.md shows them.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import re
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

SCRIPT = Path(__file__).resolve()
sys.path.insert(0, str(SCRIPT.parent))

from fuzzing.workers import KINDS, Worker, work  # noqa: E402

_WRITTEN_EVERY_S = 10.0


def main() -> None:
    """Run the cases that are asked for; leave with 1 where there are findings."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    for kind in KINDS:
        parser.add_argument(f"--{kind}", type=int, default=0, metavar="N", help=f"how many cases of {kind}")
    parser.add_argument("--first", type=int, default=0, metavar="N", help="number of the first case of each kind")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", metavar="KIND:N", help="run one case, print its input, and keep its folder")
    parser.add_argument("-j", "--processes", type=int, default=1, metavar="N", help="how many cases run at a time")
    parser.add_argument("--again", type=Path, metavar="FILE", help="run the findings of an earlier run again")
    parser.add_argument("--add", type=Path, metavar="FILE", help="results of an earlier run to add up")
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
    results: dict[str, Any] = {"counts": {}, "slowest": {}, "findings": []}
    asked = [(kind, options.first + k, options.seed) for kind in KINDS for k in range(getattr(options, kind))]
    random.Random(options.seed).shuffle(asked)
    if earlier := options.add or options.again:
        results = json.loads(earlier.read_bytes())
    if options.again:
        asked = [_taken_back(results, finding) for finding in tuple(results["findings"])]
    _run(asked, results, options.processes, options.output)
    for kind, counts in results["counts"].items():
        print(f"{kind}: {', '.join(f'{count} {outcome}' for outcome, count in sorted(counts.items()))}")
    sys.exit(1 if results["findings"] else 0)


def _taken_back(results: dict[str, Any], finding: dict[str, Any]) -> tuple[str, int, int]:
    """Take a finding out of the results; returns its case."""
    kind, number, seed = re.split(r":| --seed ", finding["case"])
    results["findings"].remove(finding)
    results["counts"][kind]["finding"] -= 1
    if not results["counts"][kind]["finding"]:
        del results["counts"][kind]["finding"]
    return kind, int(number), int(seed)


def _run(asked: list[tuple[str, int, int]], results: dict[str, Any], processes: int, output: Path | None) -> None:
    """Add the results of these cases, and write them now and then."""
    waiting, lock, written = iter(asked), threading.Lock(), time.perf_counter()

    def work_off() -> None:
        nonlocal written
        with Worker(SCRIPT) as worker:
            while True:
                with lock:
                    kind, number, seed = next(waiting, (None, 0, 0))
                if not kind:
                    return
                case = worker.run(kind, number, seed)
                with lock:
                    _add(results, kind, number, seed, case)
                    if output and time.perf_counter() - written > _WRITTEN_EVERY_S:
                        _write(results, output)
                        written = time.perf_counter()

    threads = [threading.Thread(target=work_off) for _ in range(processes)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    if output:
        _write(results, output)


def _add(results: dict[str, Any], kind: str, number: int, seed: int, case: dict[str, Any]) -> None:
    counts = results["counts"].setdefault(kind, {})
    counts[case["outcome"]] = counts.get(case["outcome"], 0) + 1
    name = f"{kind}:{number} --seed {seed}"
    if case["seconds"] > results["slowest"].get(kind, {"seconds": 0.0})["seconds"]:
        results["slowest"][kind] = {"case": name, "seconds": case["seconds"]}
    if case["outcome"] == "finding":
        results["findings"].append({"case": name, "seen": case["seen"], "input": case["input"]})
        print(f"{kind}:{number}: {case['seen']}", flush=True)
        print(f"    {' | '.join(case['input'])}"[:2000].replace("\n", "\n    "), flush=True)
        print(f"    again: scripts/fuzz.py --only {name}", flush=True)


def _write(results: dict[str, Any], output: Path) -> None:
    output.write_text(json.dumps(results, indent=1, sort_keys=True) + "\n", encoding="utf-8")


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
