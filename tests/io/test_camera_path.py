"""Camera paths: curves through their keys, files that survive, and what is wrong in words."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from greensward.io.camera_path import CameraKey, CameraPath
from greensward.scene import Camera, InputError

EXAMPLE = Path(__file__).parents[2] / "examples" / "walk.toml"


def path(*keys, **more):
    """A path of (time, position, target) or (time, position, target, fov)."""
    names = ("time_s", "position_m", "target_m", "fov_y_deg")
    return CameraPath(key=tuple(CameraKey(**dict(zip(names, key, strict=False))) for key in keys), **more)


UNEVEN = path(
    (1.0, (0, 1, 0), (0, 1, -9)),
    (2.0, (3, 2, 0), (1, 1, -9)),
    (5.0, (4, 2, -6), (9, 1, -9)),
    (5.5, (4, 3, -7), (9, 2, -12)),
)


def positions(path, times):
    return np.array([path.at(time).position_m for time in times])


def test_it_goes_through_all_keys_without_a_kink():
    for key in UNEVEN.key:
        camera = UNEVEN.at(key.time_s)
        assert np.allclose(camera.position_m, key.position_m)
        assert np.allclose(camera.target_m, key.target_m)
    for key in UNEVEN.key[1:-1]:
        before, now, after = positions(UNEVEN, [key.time_s - 1e-5, key.time_s, key.time_s + 1e-5])
        assert np.allclose(now - before, after - now, atol=1e-8)


def test_it_is_the_curve_of_catmull_and_rom():
    # of even times: half of (2 b, c - a, 2 a - 5 b + 4 c - d, 3 b - a - 3 c + d) by powers of t
    keys = np.array([[0, 1, 0], [3, 2, 0], [4, 2, -6], [4, 3, -7]], float)
    a, b, c, d = keys
    even = path(*((float(i), tuple(key), (0, 0, -99)) for i, key in enumerate(keys)))
    for t in np.linspace(0, 1, 11):
        want = 0.5 * (2 * b + (c - a) * t + (2 * a - 5 * b + 4 * c - d) * t**2 + (3 * b - a - 3 * c + d) * t**3)
        assert np.allclose(even.at(1 + t).position_m, want)


@pytest.mark.parametrize(
    ("after", "same"),
    [("stop", {0.0: 1.0, 7.0: 5.5, 99.0: 5.5}), ("repeat", {6.5: 2.0, 10.5: 1.5}), ("return", {6.0: 5.0, 10.0: 1.0})],
)
def test_before_and_after_its_keys(after, same):
    given_path = UNEVEN.model_copy(update={"after": after})
    for time_s, like in same.items():
        assert np.allclose(given_path.at(time_s).position_m, UNEVEN.at(like).position_m), time_s


def test_what_it_leaves_open_is_of_the_scenes_camera():
    camera = Camera(fov_y_deg=33.0, near_m=0.2, height_above_ground=True)
    seen = UNEVEN.model_copy(update={"height_above_ground": False}).at(2.0, camera)
    assert (seen.fov_y_deg, seen.near_m, seen.height_above_ground) == (33.0, 0.2, False)


def test_the_lens_does_not_swing_beyond_its_keys():
    zoom = path(*((float(i), (0, i, 0), (0, 0, -9), fov) for i, fov in enumerate((20.0, 20.0, 160.0, 160.0, 0.2))))
    angles = np.array([zoom.at(t).fov_y_deg for t in np.linspace(0, 4, 401)])
    assert angles.min() >= 0.2
    assert angles.max() <= 160.0
    assert zoom.at(1.5).fov_y_deg == pytest.approx(90.0)


places = st.tuples(*[st.floats(-1e5, 1e5)] * 3)


@given(
    st.lists(st.tuples(st.floats(0.001, 100), places, places.map(lambda p: (p[0], p[1], p[2] + 2e5))), min_size=2),
    st.booleans(),
    st.sampled_from(["stop", "repeat", "return"]),
)
def test_a_file_holds_it_exactly(tmp_path_factory, keys, above, after):
    times = np.cumsum([key[0] for key in keys]).tolist()
    made = path(
        *((time, *key[1:]) for time, key in zip(times, keys, strict=True)), height_above_ground=above, after=after
    )
    file = tmp_path_factory.mktemp("path") / "a.toml"
    made.write(file)
    assert CameraPath.read(file) == made
    assert file.read_text(encoding="utf-8").count("time_s") == len(keys), "a line for each key"


def test_what_is_recorded_starts_at_zero(tmp_path):
    seen = [(7.5 + i, Camera(position_m=(float(i), 2.0, 0.0), fov_y_deg=40.0 + i)) for i in range(3)]
    recorded = CameraPath.recorded(seen)
    recorded.write(tmp_path / "a.toml")
    again = CameraPath.read(tmp_path / "a.toml")
    assert again == recorded
    assert [again.at(float(i)) for i in range(3)] == [camera for _, camera in seen]
    with pytest.raises(InputError, match="two cameras at least"):
        CameraPath.recorded(seen[:1])
    with pytest.raises(InputError, match="the same height_above_ground"):
        CameraPath.recorded([*seen, (20.0, Camera(height_above_ground=False))])


KEY = "{ time_s = %s, position_m = [0, 1, 0], target_m = [0, 1, -9]%s }"


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("key = [" + KEY % (0, "") + "]", "key: must hold at least 2 values (got 1)"),
        ("", "key: is missing and has no default"),
        (f"key = [{KEY % (2, '')}, {KEY % (1, '')}]", "key[1].time_s must be above 2, the time of the key"),
        (f"key = [{KEY % (0, ', fov_y_deg = 40')}, {KEY % (1, '')}]", "must stand in every key or in none"),
        (f"key = [{KEY % (0, '')}, {KEY % (-1, '')}]", "key[1].time_s: must be at least 0 (got -1)"),
        (f"key = [{KEY % (0, ', fov_deg = 4')}, {KEY % (1, '')}]", "key[0].fov_deg: unknown key; did you mean"),
        ("key = [{ time_s = 0, position_m = [1, 1], target_m = [0, 0, 0] }]", "key[0].position_m: must hold 3"),
        ("key = [{ time_s = 0, position_m = [1, 1, 1], target_m = [1, 1, 1] }, 3]", "key[0]: target_m must differ"),
        ("key = [", "end of document: invalid value"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_told_in_words(tmp_path, text, told):
    (tmp_path / "a.toml").write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as error:
        CameraPath.read(tmp_path / "a.toml")
    assert told in str(error.value)
    assert str(error.value).startswith(str(tmp_path / "a.toml"))
    assert "pydantic" not in str(error.value)


@pytest.mark.parametrize("name", ["nothing.toml", "\0", "."])
def test_a_file_that_is_not_there_is_told(tmp_path, name):
    with pytest.raises(InputError, match=r"no such file|is a folder"):
        CameraPath.read(tmp_path / name)


def test_the_example_is_a_walk():
    walk = CameraPath.read(EXAMPLE)
    steps = np.linalg.norm(np.diff(positions(walk, np.arange(0, 24, 1 / 30)), axis=0), axis=1) * 30
    assert steps.max() < 2.0, "metres a second"
    assert walk.at(0.0).position_m == walk.at(24.0).position_m
