"""The documentation is true: its code runs, its commands work, its links lead somewhere, its pictures exist."""

import json
import re
import runpy
import shlex
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import greensward as gs
from greensward import renderer as renderers
from greensward.cli import main
from greensward.techniques import TECHNIQUES

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
FENCE = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"\]\(([^)\s]+)\)")


def fences(page: Path) -> list[tuple[str, str]]:
    return FENCE.findall(page.read_text(encoding="utf-8"))


def anchors(page: Path) -> set[str]:
    """The anchors of a page's headings, as GitHub makes them."""
    headings = re.findall(r"^#+ (.+)$", FENCE.sub("", page.read_text(encoding="utf-8")), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def is_excerpt(text: str, example: Path) -> bool:
    """Whether lines stand in an example, in this order: one that needs a window, which its own tests run."""
    lines = iter([line.strip() for line in example.read_text(encoding="utf-8").splitlines()])
    return all(line.strip() in lines for line in filter(str.strip, text.splitlines()))


@pytest.fixture
def tiny(thin_fields, monkeypatch, tmp_path):
    """A folder to work in; every renderer draws a small picture of a thin field."""

    class Tiny(renderers.Renderer):
        def __init__(self, scene, **options):
            super().__init__(scene, **options | {"size": (64, 36), "samples": 1})

    monkeypatch.setattr(renderers, "Renderer", Tiny)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run_command(line: str, monkeypatch) -> None:
    for command in line.split("&&"):
        program, *arguments = shlex.split(command, comments=True)
        if program == "greensward":
            with pytest.raises(SystemExit) as left:
                main(arguments)
            assert left.value.code == 0, command
        elif program == "python":
            monkeypatch.setattr(sys, "argv", [*arguments, "--size", "64x36", "--samples", "1"])
            runpy.run_path(str(ROOT / arguments[0]), run_name="__main__")
        else:
            assert program in {"pip", "sudo", "python3", "."}, f"{command}: the tests do not know how to try this"


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_commands_and_code_run_in_the_order_of_the_page(page, tiny, monkeypatch):
    names: dict[str, object] = {}
    for language, text in fences(page):
        if language == "sh":
            for line in filter(None, text.splitlines()):
                run_command(line, monkeypatch)
        elif language == "python":
            exec(compile(text, f"{page.name}: {text.splitlines()[0]}", "exec"), names)
        elif language == "py":
            assert any(is_excerpt(text, example) for example in (ROOT / "examples").rglob("*.py")), text
        elif language == "toml":
            folder = tiny / "hillside" if (tiny / "hillside").is_dir() else tiny
            (folder / "snippet.toml").write_text(text, encoding="utf-8")
            assert gs.load(folder / "snippet.toml")
            assert tomllib.loads(text)
        elif language == "json":
            json.loads(text)
        else:
            assert not language, f"{page.name}: what is {language}?"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_links_lead_somewhere(page):
    for target in LINK.findall(FENCE.sub("", page.read_text(encoding="utf-8"))):
        if target.startswith(("https://", "mailto:")):
            continue
        file, _, anchor = target.partition("#")
        linked = (page.parent / file).resolve() if file else page
        assert linked.is_file(), f"{page.name} links to {target}"
        assert linked.is_relative_to(ROOT), f"{page.name} links out of the repository: {target}"
        if anchor:
            assert anchor in anchors(linked), f"{page.name} links to {target}; there are {sorted(anchors(linked))}"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_no_page_tells_of_one_machine(page):
    text = page.read_text(encoding="utf-8")
    assert not re.search(r"(?<![\w.])/(home|root|work|tmp|Users)/", text)


def test_figures_of_speed_are_those_that_are_kept(monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["figures.py", "--check"])
    with pytest.raises(SystemExit) as left:
        runpy.run_path(str(ROOT / "scripts" / "figures.py"), run_name="__main__")
    assert (left.value.code, capsys.readouterr().err) == (0, "")


def test_every_picture_is_shown_drawn_by_the_script_and_small():
    pictures = sorted((ROOT / "docs" / "pictures").iterdir())
    shown = "".join(page.read_text(encoding="utf-8") for page in PAGES)
    drawn = runpy.run_path(str(ROOT / "scripts" / "pictures.py"))["PICTURES"]
    assert {path.name for path in pictures} == set(drawn)
    assert not [path.name for path in pictures if f"pictures/{path.name})" not in shown]


def test_pictures_are_small():
    # each redraw of a picture stays in the history for good: CONTRIBUTING.md states the sum
    pictures = sorted((ROOT / "docs" / "pictures").iterdir())
    plots = [path for path in (ROOT / "docs" / "benchmarks").rglob("*") if path.suffix not in ("", ".md", ".json")]
    for path in pictures + plots:
        with Image.open(path) as picture:
            assert picture.format == {".jpg": "JPEG", ".webp": "WEBP"}[path.suffix], path.name
        assert path.stat().st_size <= 300_000, path.name
    assert sum(path.stat().st_size for path in pictures) <= 8_000_000
    assert sum(path.stat().st_size for path in plots) <= 1_000_000


@pytest.mark.slow
def test_a_picture_that_is_too_large_is_encoded_at_a_lower_quality():
    encoded = runpy.run_path(str(ROOT / "scripts" / "pictures.py"))["encoded"]
    noise = np.random.default_rng(1).integers(0, 256, (600, 800, 3), dtype=np.uint8)
    for suffix in (".jpg", ".webp"):
        assert 200_000 < len(encoded(Image.fromarray(noise), suffix)) <= 300_000
    with pytest.raises(gs.InputError, match="1600×2400 pixels"):
        encoded(Image.fromarray(np.tile(noise, (4, 2, 1))), ".jpg")


def test_every_technique_has_a_section_with_its_settings_and_sources():
    page = (ROOT / "docs" / "techniques.md").read_text(encoding="utf-8")
    for technique in TECHNIQUES:
        section = page.partition(f"\n## `{technique.name}`\n")[2].partition("\n## ")[0]
        assert all(f"`{name}`" in section for name in technique.Settings.model_fields)
        told = " ".join(section.replace("*", "").split())
        assert all(each in told for each in technique.source.split("; "))


def test_every_shape_is_described():
    from greensward.scene.grass import SHAPES

    page = (ROOT / "docs" / "techniques.md").read_text(encoding="utf-8")
    assert all(f"| `{shape}` |" in page for shape in SHAPES)


def test_the_glossary_is_alphabetical_and_its_places_exist():
    page = (ROOT / "docs" / "glossary.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (?!term|-)(.+?)(?: \*)? \| .+ \| (.+) \|$", page, re.MULTILINE)
    terms = [term.lower() for term, _ in rows]
    assert len(terms) > 40
    assert terms == sorted(terms)
    places = [place for _, named in rows for place in re.findall(r"`([^`]+)`", named)]
    assert [place for place in places if not (ROOT / "src" / "greensward" / place).exists()] == []
