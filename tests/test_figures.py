"""`scripts/figures.py`: what it writes into a page, and what it says of a page or a result that lacks something."""

import json
import runpy
import shutil
import sys
from pathlib import Path

import pytest

from greensward.bench.suite import FORMAT

SCRIPT = Path(__file__).parents[1] / "scripts" / "figures.py"
MS = "ms: cpu / blade-count / visibility-buffer / 1M"


def row(technique="visibility-buffer", case="1M", ms=191.2, **changes):
    blades = {f"blades_{name}": 999_757 for name in ("sown", "considered", "drawn")}
    took = {
        "frame_ms_median": ms,
        "wall_ms_median": ms,
        "cpu_ms_median": None,
        "frames": 7,
        "pass_ms": {"grass": ms / 2},
    }
    size = {"width": 640, "height": 360}
    return {"workload": "blade-count", "technique": technique, "case": case, **size, **blades, **took, **changes}


class Clone:
    """A repository with one page and the results of one machine."""

    def __init__(self, folder: Path, monkeypatch, capsys) -> None:
        self.monkeypatch, self.capsys = monkeypatch, capsys
        self.page, self.docs = folder / "README.md", folder / "docs"
        (self.docs / "benchmarks").mkdir(parents=True)
        (folder / "scripts").mkdir()
        self.script = shutil.copy(SCRIPT, folder / "scripts")
        self.keep("llvmpipe", row())

    def keep(self, name: str, *rows: object, driver: str = "llvmpipe") -> None:
        kept = {"machine": {"format": FORMAT, "driver": driver}, "rows": rows}
        (self.docs / "benchmarks" / f"{name}.json").write_text(json.dumps(kept), encoding="utf-8")

    def run(self, text: str, *arguments: str) -> tuple[int, str, str]:
        """Exit code, what is said, and the page."""
        self.page.write_text(text, encoding="utf-8")
        self.monkeypatch.setattr(sys, "argv", ["figures.py", *arguments])
        with pytest.raises(SystemExit) as left:
            runpy.run_path(str(self.script), run_name="__main__")
        return left.value.code, self.capsys.readouterr().err.strip(), self.page.read_text(encoding="utf-8")


@pytest.fixture
def clone(tmp_path, monkeypatch, capsys):
    return Clone(tmp_path, monkeypatch, capsys)


def test_a_sentence_and_a_table_are_written_and_then_hold(clone):
    before = f"A frame takes <!-- {MS} -->9 ms<!-- / -->.\n\n<!-- fields: cpu --><!-- / -->\n"
    assert clone.run(before, "--check") == (1, "README.md: is not what scripts/figures.py writes; run it", before)
    code, told, page = clone.run(before)
    assert (code, told) == (0, "")
    assert f"takes <!-- {MS} -->191 ms<!-- / -->.\n" in page
    assert "| 1M | `visibility-buffer` | 999,757 | 999,757 | 999,757 | 191 |\n\n<!-- / -->\n" in page
    assert clone.run(page, "--check") == (0, "", page)


def test_a_table_has_the_rows_and_columns_that_there_are(clone):
    clone.keep("nvidia-a", row(cpu_ms_median=1.5), row(case="10M", cpu_ms_median=2.5), driver="A")
    clone.keep("nvidia-a-more", row(case="10M", ms=2.0, cpu_ms_median=1.25, first_frame_s=0.5), driver="A")
    _, _, page = clone.run("<!-- fields: gpu --><!-- / -->\n")
    assert "| frame | with Python | Python | first picture, s |\n" in page
    assert "| 10M | `visibility-buffer` | 999,757 | 999,757 | 999,757 | 2.00 | 2.00 | 1.25 | 0.50 |\n" in page
    assert "| 1.50 | – |\n" in page


def test_a_sentence_tells_of_the_first_case_that_there_is(clone):
    text = "It draws <!-- drawn: cpu / visibility-buffer / 10M / 1M --><!-- / -->."
    assert ">a million blades in 191 ms<" in clone.run(text)[2]
    clone.keep("llvmpipe-more", row(case="10M", ms=1300.0))
    assert ">ten million blades in 1,300 ms<" in clone.run(text)[2]


NO_ROW = (
    "workload blade-count, technique bezier-blades, case 1M: is not in docs/benchmarks/llvmpipe.json; "
    "measure it with greensward bench"
)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (f"It takes <!-- {MS.replace('visibility-buffer', 'bezier-blades')} -->5<!-- / -->.", NO_ROW),
        (f"It takes <!-- {MS} -->5 and <!-- {MS} -->5<!-- / -->.", "is not closed by <!-- / -->"),
        (f"It takes <!-- {MS} -->5.", "has no other end"),
        ("It takes 5<!-- / -->.", "<!-- / -->: has no other end"),
        (f"<!-- {MS} -->5<!-- / -->", "must not begin a line, as only tables do"),
        ("Here: <!-- fields: cpu --><!-- / -->", "must begin a line, as tables do"),
        ("It takes <!-- minutes: cpu -->5<!-- / -->.", "KeyError('minutes'); scripts/figures.py has what there is"),
        ("It takes <!-- ms: cpu -->5<!-- / -->.", "missing 3 required positional arguments"),
        (
            "<!-- limits --><!-- / -->",
            "docs/performance/limits-*.json: there is none; keep what scripts/measure_limits.py",
        ),
        ("It is <!-- origin: gpu --><!-- / -->.", "docs/benchmarks/nvidia-*.json: must be of one machine"),
    ],
    ids=str,
)
def test_what_cannot_be_written_is_one_sentence_and_the_page_stays(clone, text, told):
    code, said, page = clone.run(text)
    assert (code, page) == (2, text)
    assert told in said
    assert said.startswith("README.md: ")
    assert "\n" not in said


def test_results_of_two_machines_are_not_mixed(clone):
    clone.keep("nvidia-a", row(), driver="A")
    clone.keep("nvidia-b", row(), driver="B")
    assert "must be of one machine; keep the files of one" in clone.run("It is <!-- origin: gpu --><!-- / -->.")[1]
