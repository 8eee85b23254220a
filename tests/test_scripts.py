"""The set-up scripts: sound shell, and the right words where something is missing. They install nothing."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
SCRIPTS = [*sorted(path for path in (ROOT / "scripts").iterdir() if path.is_file()), ROOT / ".ci" / "run"]
INSTALL = "sudo apt install libegl1 libgl1 libgl1-mesa-dri"

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the scripts are for Linux")


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.name)
def test_scripts_are_sound(script: Path) -> None:
    text = script.read_text(encoding="utf-8")
    assert not re.search(r"/(home|root|work|tmp)/|https?://", text)
    if script.name != "setup.sh":
        assert os.access(script, os.X_OK)
        assert text.startswith(("#!/usr/bin/env bash\n", "#!/usr/bin/env python3\n"))
    if text.startswith("#!/usr/bin/env python3\n"):
        compile(text, script, "exec")
    else:
        subprocess.run(["bash", "-n", script], check=True)
        assert script.name == "setup.sh" or "set -euo pipefail" in text


def test_ci_runs_the_readmes_command() -> None:
    assert "./scripts/test" in (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    assert "./scripts/test" in (ROOT / ".github" / "workflows" / "ci.yml").read_text(encoding="utf-8")


def test_constraints_hold_versions_only() -> None:
    lines = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
    assert all(re.fullmatch(r"#.*|[a-z0-9.-]+==[0-9a-z.]+", line) for line in lines)


class Machine:
    """A copy of the scripts on a machine whose commands can be replaced."""

    def __init__(self, folder: Path) -> None:
        self.root = folder / "a clone"
        shutil.copytree(ROOT / "scripts", self.root / "scripts")
        for name in ("pyproject.toml", "constraints.txt"):
            shutil.copy(ROOT / name, self.root)
        self.bin = folder / "bin"
        self.bin.mkdir()
        self.path = f"{self.bin}{os.pathsep}{os.environ['PATH']}"
        self.environment = {"PYTHON": sys.executable}
        self.log = folder / "log"
        self.command("sudo", "exit 1")
        self.command("apt-get", f'echo "apt-get $*" >> "{self.log}"')
        self.user(1000)

    def command(self, name: str, body: str) -> None:
        path = self.bin / name
        path.write_text(f"#!{shutil.which('bash')}\n{body}\n", encoding="utf-8")
        path.chmod(0o755)

    def user(self, number: int) -> None:
        self.command("id", f"echo {number}")

    def without_gl(self) -> None:
        # the vendor-neutral library finds no driver, as if none were installed
        self.environment["__EGL_VENDOR_LIBRARY_DIRS"] = str(self.bin)
        self.environment["__EGL_VENDOR_LIBRARY_FILENAMES"] = ""

    def run(self, script: str) -> tuple[int, str]:
        left = subprocess.run(
            [shutil.which("bash") or "bash", self.root / "scripts" / script],
            env={"PATH": self.path, "CI": "true", **self.environment},
            cwd="/",
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=60,
        )
        assert left.stdout == ""
        assert not (self.root / ".venv").exists()
        return left.returncode, left.stderr.strip()

    def installed(self) -> str:
        return self.log.read_text(encoding="utf-8") if self.log.exists() else ""


@pytest.fixture
def machine(tmp_path: Path) -> Machine:
    return Machine(tmp_path)


@pytest.mark.parametrize("script", ["meadow", "test"])
def test_without_gl_and_root_the_exact_line_is_told(machine: Machine, script: str) -> None:
    machine.without_gl()
    assert machine.run(script) == (1, f"Something is missing. Please run: {INSTALL}")
    assert machine.installed() == ""


@pytest.mark.parametrize("root", [True, False], ids=["root", "sudo"])
def test_without_gl_it_is_installed_where_that_is_allowed(machine: Machine, root: bool) -> None:
    machine.without_gl()
    if root:
        machine.user(0)
    else:
        machine.command("sudo", 'case $1 in -n|-v) ;; *) "$@" ;; esac')
    code, said = machine.run("test")
    assert machine.installed() == ("apt-get install -y --no-install-recommends libegl1 libgl1 libgl1-mesa-dri\n")
    assert code == 1  # nothing was really installed
    assert said.splitlines() == [
        "Installing libegl1 libgl1 libgl1-mesa-dri with apt ...",
        "No OpenGL driver starts, though these are installed: libegl1 libgl1 libgl1-mesa-dri",
    ]


def test_a_failing_apt_tells_the_line(machine: Machine) -> None:
    machine.without_gl()
    machine.user(0)
    machine.command("apt-get", f'echo "apt-get $1" >> "{machine.log}"; echo no mirror answers; exit 100')
    code, said = machine.run("meadow")
    assert code == 1
    assert machine.installed() == "apt-get install\napt-get update\n"
    assert said.splitlines()[1:] == ["no mirror answers", f"That failed. Please run: {INSTALL}"]


def _python(machine: Machine, name: str, *, version: str, has_venv: bool) -> None:
    """A Python that answers what the scripts ask."""
    old = version.startswith("Python 3.10")
    machine.command(
        name,
        f"""case "$*" in
          --version) echo "{version}" ;;
          *print*) echo python3.11-venv ;;
          *version_info*) exit {int(old)} ;;
          *ensurepip*) exit {int(not has_venv)} ;;
          *) exec "{sys.executable}" "$@" ;;
        esac""",
    )


def test_a_python_that_is_too_old_is_named(machine: Machine) -> None:
    _python(machine, "python-old", version="Python 3.10.12", has_venv=True)
    machine.environment["PYTHON"] = "python-old"
    code, said = machine.run("check")
    assert code == 1
    assert said.startswith("greensward needs Python 3.11 or newer (found Python 3.10.12). Install one, then: PYTHON=")
    machine.environment["PYTHON"] = "no-such-python"
    assert "(found nothing that runs as no-such-python)" in machine.run("check")[1]


def test_a_python_without_venv_names_its_package(machine: Machine) -> None:
    _python(machine, "python-bare", version="Python 3.11.2", has_venv=False)
    machine.environment["PYTHON"] = "python-bare"
    line = "Something is missing. Please run: sudo apt install python3.11-venv"
    assert machine.run("check") == (1, line)
    machine.without_gl()
    assert machine.run("test") == (1, f"{line} libegl1 libgl1 libgl1-mesa-dri")


def test_no_python_at_all_names_everything(machine: Machine) -> None:
    del machine.environment["PYTHON"]
    for name in ("bash", "dirname", "uname", "env", "cat", "mktemp", "tail", "rm"):
        (machine.bin / name).symlink_to(shutil.which(name) or name)
    machine.path = str(machine.bin)
    assert machine.run("test") == (
        1,
        f"Something is missing. Please run: {INSTALL}".replace("libegl1", "python3 python3-venv libegl1"),
    )


def test_macos_is_told_at_start(machine: Machine) -> None:
    machine.command("uname", "echo Darwin")
    code, said = machine.run("meadow")
    assert code == 1
    assert said.startswith("macOS offers OpenGL 4.1 at most and greensward needs 4.3")
