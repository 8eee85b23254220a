"""The documentation is true: its code runs, its commands work, its links lead somewhere, its pictures exist."""

import re
import runpy
import shlex
import sys
import tomllib
from pathlib import Path

import pytest

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


@pytest.fixture
def tiny(monkeypatch, tmp_path):
    """Every renderer draws a thin field, small: what a page says is tried in full, but not at its price."""

    class Tiny(renderers.Renderer):
        def __init__(self, scene, **options):
            sowing = scene.sowing.model_copy(update={"density_per_m2": 30.0, "reach_m": 25.0})
            thin = {"sowing": sowing, "shadows": scene.shadows.model_copy(update={"size_px": 64})}
            options |= {"size": (64, 36), "samples": 1}
            super().__init__(scene.model_copy(update=thin), **options)

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


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_commands_and_code_run_in_the_order_of_the_page(page, tiny, monkeypatch):
    names: dict[str, object] = {}
    for language, text in fences(page):
        if language == "sh":
            for line in filter(None, text.splitlines()):
                run_command(line, monkeypatch)
        elif language == "python":
            exec(compile(text, f"{page.name}: {text.splitlines()[0]}", "exec"), names)
        elif language == "toml":
            folder = tiny / "hillside" if (tiny / "hillside").is_dir() else tiny
            (folder / "snippet.toml").write_text(text, encoding="utf-8")
            assert gs.load(folder / "snippet.toml")
            assert tomllib.loads(text)
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
    monkeypatch.setattr(sys, "argv", ["figures", "--check"])
    with pytest.raises(SystemExit) as left:
        runpy.run_path(str(ROOT / "scripts" / "figures"), run_name="__main__")
    assert (left.value.code, capsys.readouterr().err) == (0, "")


def test_every_picture_is_shown_drawn_by_the_script_and_small():
    pictures = sorted((ROOT / "docs" / "pictures").iterdir())
    shown = "".join(page.read_text(encoding="utf-8") for page in PAGES)
    drawn = runpy.run_path(str(ROOT / "scripts" / "pictures"))["PICTURES"]
    assert {path.name for path in pictures} == set(drawn)
    assert not [path.name for path in pictures if f"pictures/{path.name})" not in shown]
    assert sum(path.stat().st_size for path in pictures) < 9 * 2**20


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
