"""Small pictures on the software driver against references that a human has looked at.

    python tests/test_pictures.py --accept [NAME ...]

draws the references anew, all or some. Look at them before they are committed.
"""

import sys
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from PIL import Image

from greensward.gpu.device import Device
from greensward.renderer import Renderer
from greensward.scene import Scene

REFERENCES, FAILURES = Path(__file__).parent / "pictures", Path(__file__).parent / "failures"
SIZE, SAMPLES = (320, 180), 2
MOST_DIFFERING, STEP = 0.001, 5
Picture = npt.NDArray[np.uint8]

_SHADOWS = {"size_px": 256, "cascades": 2, "nearest_m": 6.0, "furthest_m": 60.0}
_HILL = np.add.outer(18 * np.linspace(1, 0, 33) ** 1.5, 1.5 * np.sin(np.linspace(0, 9, 33)))
SCENES: dict[str, dict[str, Any]] = {
    "meadow": {
        "seed": 3,
        "ground": {"kind": "noise", "size_m": [200, 200], "samples": 129, "height_m": 6.0, "wavelength_m": 60.0},
        "grass": [
            {"species": "meadow-grass", "share": 0.7},
            {"species": "bent", "share": 0.15},
            {"species": "daisy", "share": 0.1},
            {"species": "poppy", "share": 0.05},
        ],
        "sowing": {"density_per_m2": 150.0, "full_density_m": 4.0, "reach_m": 30.0, "drift": 0.7},
        "wind": [{"kind": "gusts", "speed_mps": 5.0}],
        "sun": {"azimuth_deg": 300.0, "elevation_deg": 14.0},
        "shadows": _SHADOWS,
        "camera": {"position_m": [0.0, 1.3, 8.0], "target_m": [0.0, 1.0, -10.0]},
    },
    "lawn": {
        "grass": [{"species": "lawn"}],
        "sowing": {"density_per_m2": 3000.0, "full_density_m": 1.5, "reach_m": 4.0},
        "wind": [],
        "sun": {"azimuth_deg": 120.0, "elevation_deg": 40.0},
        "shadows": {**_SHADOWS, "nearest_m": 2.0, "cascades": 1},
        "camera": {"position_m": [0.0, 0.25, 0.8], "target_m": [0.0, 0.0, -0.6]},
        "object": [{"kind": "sphere", "position_m": [0.25, -0.02, -0.3], "size_m": [0.22, 0.22, 0.22]}],
    },
    "hillside": {
        "ground": {"kind": "heightmap", "file": "hill.npy", "size_m": [64, 64]},
        "sowing": {"density_per_m2": 60.0, "reach_m": 40.0, "max_slope_deg": 30.0},
        "wind": [{"kind": "gusts", "speed_mps": 9.0, "direction_deg": 90.0}],
        "sun": {"azimuth_deg": 110.0, "elevation_deg": 30.0},
        "sky": {"haze": 3.0},
        "shadows": _SHADOWS,
        "camera": {"position_m": [0.0, 1.5, 14.0], "target_m": [0.0, 0.0, -14.0]},
    },
}


def draw(name: str, folder: Path, device: Device) -> Picture:
    """A scene of the list as it is drawn now; its height map is written into the folder."""
    np.save(folder / "hill.npy", _HILL.astype(np.float32))
    scene = Scene.model_validate(SCENES[name]).in_folder(folder)
    with Renderer(scene, size=SIZE, samples=SAMPLES, device=device) as renderer:
        return renderer.render(1.5).image


def compare(name: str, actual: Picture, references: Path = REFERENCES, failures: Path = FAILURES) -> None:
    """Fails where too many pixels differ, or where there is no reference; keeps what there is to look at."""
    failures.mkdir(exist_ok=True)
    kept = {part: failures / f"{name}-{part}.png" for part in ("actual", "expected", "difference")}
    for path in kept.values():
        path.unlink(missing_ok=True)
    reference = references / f"{name}.png"
    how = f"look at it, then: python tests/test_pictures.py --accept {name}"
    if not reference.exists():
        Image.fromarray(actual).save(kept["actual"])
        pytest.fail(f"{name}: there is no reference; {kept['actual']} is what was drawn; {how}", pytrace=False)
    expected = np.asarray(Image.open(reference).convert("RGB"))
    same_size = expected.shape == actual.shape
    step = np.abs(expected.astype(int) - actual).max(axis=2) if same_size else np.full(actual.shape[:2], 255)
    differing = float((step > STEP).mean())
    if differing > MOST_DIFFERING:
        Image.fromarray(actual).save(kept["actual"])
        Image.fromarray(expected).save(kept["expected"])
        Image.fromarray(np.minimum(step * 8, 255).astype(np.uint8)).save(kept["difference"])
        pytest.fail(
            f"{name}: {differing:.2%} of the pixels differ by more than {STEP}/255 "
            f"(at most {MOST_DIFFERING:.2%} may); see {failures}/{name}-*.png; if it is meant so: {how}",
            pytrace=False,
        )


@pytest.mark.parametrize("name", SCENES)
def test_picture(device, tmp_path, name):
    if not device.name.startswith("llvmpipe"):
        pytest.skip(f"references are drawn by llvmpipe, and this is {device.name}")
    compare(name, draw(name, tmp_path, device))


@pytest.fixture
def folders(tmp_path) -> tuple[Path, Path]:
    references, failures = tmp_path / "references", tmp_path / "failures"
    references.mkdir()
    return references, failures


def _picture(seed: int = 0) -> Picture:
    return np.random.default_rng(seed).integers(0, 200, (40, 50, 3), dtype=np.uint8)


def test_a_missing_reference_fails_and_keeps_the_picture(folders):
    with pytest.raises(pytest.fail.Exception, match=r"some: there is no reference.*--accept some"):
        compare("some", _picture(), *folders)
    assert [path.name for path in folders[1].iterdir()] == ["some-actual.png"]


@pytest.mark.parametrize(
    ("pixels", "step", "passes"), [(2000, 5, True), (2, 255, True), (3, 6, False), (2000, 6, False)]
)
def test_how_much_may_differ(folders, pixels, step, passes):
    """A thousandth of 2000 pixels is two."""
    expected = _picture()
    actual = expected.copy()
    actual.reshape(-1, 3)[:pixels, 1] = np.minimum(actual.reshape(-1, 3)[:pixels, 1].astype(int) + step, 255)
    Image.fromarray(expected).save(folders[0] / "some.png")
    if passes:
        compare("some", actual, *folders)
        assert not list(folders[1].iterdir())
        return
    with pytest.raises(pytest.fail.Exception, match="of the pixels differ by more than 5/255"):
        compare("some", actual, *folders)
    kept = {
        part: np.asarray(Image.open(folders[1] / f"some-{part}.png")) for part in ("actual", "expected", "difference")
    }
    assert np.array_equal(kept["actual"], actual)
    assert np.array_equal(kept["expected"], expected)
    assert (kept["difference"] > 0).sum() == pixels


def test_another_size_fails(folders):
    Image.fromarray(_picture()[:-1]).save(folders[0] / "some.png")
    with pytest.raises(pytest.fail.Exception, match=r"100\.00% of the pixels"):
        compare("some", _picture(), *folders)


def test_old_failures_go_when_the_picture_passes_again(folders):
    Image.fromarray(_picture()).save(folders[0] / "some.png")
    with pytest.raises(pytest.fail.Exception):
        compare("some", _picture(1), *folders)
    compare("some", _picture(), *folders)
    assert not list(folders[1].iterdir())


def accept(names: list[str]) -> int:
    """Draw references, of all scenes or those named; 0 when done."""
    unknown = [name for name in names if name not in SCENES]
    if unknown:
        print(f"{unknown[0]}: must be one of {', '.join(SCENES)}", file=sys.stderr)
        return 2
    device = Device("cpu")
    if not device.name.startswith("llvmpipe"):
        print(f"references are drawn by llvmpipe, and this is {device.name}", file=sys.stderr)
        return 1
    REFERENCES.mkdir(exist_ok=True)
    FAILURES.mkdir(exist_ok=True)
    for name in names or SCENES:
        Image.fromarray(draw(name, FAILURES, device)).save(REFERENCES / f"{name}.png", optimize=True)
        print(REFERENCES / f"{name}.png")
    device.release()
    return 0


if __name__ == "__main__":
    if "--accept" not in sys.argv[1:]:
        sys.exit(__doc__)
    sys.exit(accept([argument for argument in sys.argv[1:] if argument != "--accept"]))
