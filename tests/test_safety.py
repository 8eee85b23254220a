"""What docs/safety.md promises of files from others: the paths that they reach, no network and no code."""

import json
import os
import stat
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from greensward.scene import GreenswardError, InputError
from greensward.scene.errors import SceneError
from greensward.scene.files import check_writable, open_file, written_aside

HERE = Path(__file__).parent
_AUDITED = """
import json, sys
reached = []
def audit(event, args):
    if event == "open" and isinstance(args[0], (str, bytes)):
        writes = isinstance(args[1], str) and set(args[1]) & set("wax+") or isinstance(args[2], int) and args[2] & 3
        reached.append(["write" if writes else "read", str(args[0])])
    elif event.startswith(("socket.", "urllib.", "subprocess.", "os.system", "os.exec", "os.posix_spawn", "pickle.")):
        reached.append([event, str(args)])
    elif event == "os.rename":
        reached.append(["write", str(args[1])])
import greensward.cli.app, greensward.cli.check, numpy, PIL.Image  # what a command imports is not what a file reaches
from greensward.cli.check import _read
from greensward.library import load
from greensward.io.checkpoints import read_checkpoint
from greensward.io.camera_path import CameraPath
from greensward.bench import record
from pathlib import Path
sys.addaudithook(audit)
for kind, name in json.loads(sys.argv[1]):
    try:
        if kind == "scene":
            from greensward.scene.load import load as load_with
            load_with(name, read_file=_read)
        else:
            {"checkpoint": read_checkpoint, "path": CameraPath.read, "bench": record.read}[kind](Path(name))
    except Exception as error:
        assert type(error).__module__ == "greensward.scene.errors", (kind, name, error)
print(json.dumps(reached))
"""


def _reached(folder: Path, *files: tuple[str, str]) -> list[tuple[str, str]]:
    """Events of Python's audit hooks while files are read, but for modules and what the system has of itself."""
    done = subprocess.run(
        [sys.executable, "-c", _AUDITED, json.dumps(files)],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
        capture_output=True,
        text=True,
        timeout=100,
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    own = (sys.prefix, sys.base_prefix, str(HERE.parent / "src"), "/proc/", "/sys/", os.devnull)
    return [(what, path) for what, path in json.loads(done.stdout) if not path.startswith(own)]


@pytest.mark.slow
def test_files_reach_what_they_name_and_nothing_else(tmp_path):
    Image.new("RGB", (4, 4)).save(tmp_path / "map.png")
    (tmp_path / "m.ply").write_bytes((HERE / "io/meshes/tex-http.ply").read_bytes())
    described = (HERE / "io/meshes/uri-fifo.gltf").read_text().replace('"fifo"', '"http://127.0.0.1:9/x.bin"')
    (tmp_path / "m.gltf").write_text(described)
    (tmp_path / "m.obj").write_text("mtllib m.mtl\nusemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    (tmp_path / "m.mtl").write_text("newmtl a\nmap_Kd map.png\n")
    np.savez(tmp_path / "pickled.npz", clip_scene=np.array([{}], object))
    (tmp_path / "h.asc").write_text("ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n1 2\n3 4\n")
    (tmp_path / "vrt.asc").write_text('<VRTDataset rasterXSize="2"><SourceFilename>/etc/passwd</SourceFilename>')
    objects = "".join(
        f'[[object]]\nkind = "mesh"\nfile = "{name}"\nposition_m = [0, 0, 0]\n'
        for name in ("m.ply", "m.gltf", "m.obj")
    )
    (tmp_path / "a.toml").write_text(f'[sowing]\ndensity_map = "map.png"\n{objects}')
    for name in ("h.asc", "vrt.asc", "pickled.npz"):
        (tmp_path / f"{name}.toml").write_text(f'[ground]\nkind = "heightmap"\nfile = "{name}"\nsize_m = [9, 9]\n')
    (tmp_path / "b.json").write_text("{}")
    scenes = [("scene", name) for name in ("a.toml", "h.asc.toml", "vrt.asc.toml", "pickled.npz.toml")]
    reached = _reached(tmp_path, *scenes, ("checkpoint", "pickled.npz"), ("path", "a.toml"), ("bench", "b.json"))
    assert {what for what, _ in reached} == {"read"}
    there = {file.name for file in tmp_path.iterdir()}
    assert {Path(path).name for _, path in reached} <= there
    assert {"map.png", "m.mtl", "m.ply", "m.gltf", "b.json"} <= {Path(path).name for _, path in reached}


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no pipes by name")
def test_pipes_and_devices_are_refused_at_once(tmp_path):
    os.mkfifo(tmp_path / "pipe.png")
    for path in (tmp_path / "pipe.png", Path("/dev/zero")):
        with pytest.raises(InputError, match="is not a file"):
            open_file(path)
    with pytest.raises(InputError, match="is not a file"):
        check_writable(tmp_path / "pipe.png", (".png",))


def test_an_output_is_not_written_through_a_link_with_a_name_that_can_be_foreseen(tmp_path, monkeypatch):
    (tmp_path / "victim").write_text("precious")
    monkeypatch.setattr("secrets.token_hex", lambda _: "0")
    (tmp_path / ".0.part").symlink_to(tmp_path / "victim")
    with pytest.raises(GreenswardError, match="cannot be written"), written_aside(tmp_path / "a") as stream:
        stream.write(b"x")
    assert (tmp_path / "victim").read_text() == "precious"


def test_a_replaced_file_keeps_its_mode_and_a_link_stays(tmp_path):
    target, link = tmp_path / "target.png", tmp_path / "link.png"
    target.write_bytes(b"old")
    target.chmod(0o640)
    link.symlink_to(target)
    with written_aside(link) as stream:
        stream.write(b"new")
    assert link.is_symlink()
    assert target.read_bytes() == b"new"
    assert stat.S_IMODE(target.stat().st_mode) == 0o640
    mask = os.umask(0o027)
    try:
        with written_aside(tmp_path / "fresh") as stream:
            stream.write(b"x")
    finally:
        os.umask(mask)
    assert stat.S_IMODE((tmp_path / "fresh").stat().st_mode) == 0o640
    assert {path.name for path in tmp_path.iterdir()} == {"target.png", "link.png", "fresh"}


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="only root can make files of others")
def test_a_link_of_another_user_in_a_shared_folder_is_refused(tmp_path):
    shared = tmp_path / "shared"
    shared.mkdir()
    shared.chmod(0o1777)
    (tmp_path / "victim.png").write_bytes(b"precious")
    (shared / "a.png").symlink_to(tmp_path / "victim.png")
    os.lchown(shared / "a.png", 12345, 12345)
    for attempt in (lambda: check_writable(shared / "a.png", (".png",)), lambda: _write(shared / "a.png")):
        with pytest.raises(GreenswardError, match="a link that another user put into a shared folder"):
            attempt()
    assert (tmp_path / "victim.png").read_bytes() == b"precious"


def _write(path: Path) -> None:
    with written_aside(path) as stream:
        stream.write(b"x")


def test_an_error_tells_twenty_problems_and_the_number_of_others():
    error = SceneError((f"a.toml: key{number}: is wrong" for number in range(50)), untold=7)
    assert len(error.problems) == 50
    assert str(error).splitlines()[19:] == ["a.toml: key19: is wrong", "and 37 more problems"]
