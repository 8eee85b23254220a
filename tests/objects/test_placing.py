"""Where objects are: still ones, those on paths, rolling ones, and those that a program moves."""

import numpy as np
import pytest
from pydantic import TypeAdapter, ValidationError

from greensward.ground import HeightField
from greensward.objects import placing
from greensward.objects.helicopter import helicopters
from greensward.objects.placing import Placing
from greensward.scene import Helicopter, InputError
from greensward.scene.objects import Object
from small_scenes import NOISE, small_scene

_FLAT = HeightField.of(small_scene())
_KEYS = {"times_s": [1.0, 2.0, 4.0], "positions_m": [[0, 0, 0], [2, 1, 0], [2, 1, 6]]}


def _ball(**keys: object) -> Object:
    values = {"kind": "sphere", "position_m": [1.0, 0.5, 2.0], "name": "ball", **keys}
    return TypeAdapter(Object).validate_python(values)


def _positions(path: dict[str, object], times: list[float]) -> np.ndarray:
    placing = Placing([_ball(path={**_KEYS, **path})], _FLAT)
    return np.array([placing.at(t)[0, :3, 3] for t in times])


def test_a_still_object_stands_on_the_ground():
    heights = HeightField.of(small_scene(ground=NOISE))
    placing = Placing([_ball(yaw_deg=90.0)], heights)
    assert not any(placing.moving)
    expected = [1.0, 0.5 + float(heights.height(1.0, 2.0)), 2.0]
    assert np.allclose(placing.at(3.0)[0, :3, 3], expected)
    # its own x points north after a quarter turn
    assert np.allclose(placing.at(3.0)[0, :3, 0], [0, 0, -1], atol=1e-12)


def test_a_straight_path_goes_through_its_keys():
    got = _positions({"smooth": False}, [0.0, 1.0, 1.5, 2.0, 3.0, 4.0, 9.0])
    expected = [[0, 0, 0], [0, 0, 0], [1, 0.5, 0], [2, 1, 0], [2, 1, 3], [2, 1, 6], [2, 1, 6]]
    assert np.allclose(got, expected)


def test_a_smooth_path_goes_through_its_keys_without_a_kink():
    assert np.allclose(_positions({}, [1.0, 2.0, 4.0]), _KEYS["positions_m"])
    before, at, after = _positions({}, [2.0 - 1e-5, 2.0, 2.0 + 1e-5])
    assert np.allclose((at - before) / 1e-5, (after - at) / 1e-5, atol=1e-3)


def test_a_path_stops_repeats_or_returns():
    times = [4.5, 5.5, 7.0]
    assert np.allclose(_positions({"after": "stop"}, times), [[2, 1, 6]] * 3)
    straight = {"smooth": False}
    assert np.allclose(
        _positions({"after": "repeat", **straight}, times),
        _positions(straight, [1.5, 2.5, 4.0])[[0, 1, 0]] * [[1], [1], [0]],
    )
    assert np.allclose(_positions({"after": "return", **straight}, times), _positions(straight, [3.5, 2.5, 1.0]))


def test_paths_that_begin_before_the_first_picture():
    """Each on its own, beside others that begin later."""
    early = {**_KEYS, "times_s": [-50.0, -2.0, 3.0], "smooth": False}
    placing = Placing([_ball(path={**_KEYS, "smooth": False}, name="late"), _ball(path=early)], _FLAT)
    times = [-60.0, -26.0, 0.0, 3.0, 9.0]
    got = np.array([placing.at(t)[1, :3, 3] for t in times])
    assert np.allclose(got, [[0, 0, 0], [1, 0.5, 0], [2, 1, 2.4], [2, 1, 6], [2, 1, 6]])
    assert np.allclose(placing.at(-26.0)[0, :3, 3], 0.0)
    assert np.allclose(placing.at(1.5)[0, :3, 3], [1, 0.5, 0])


def test_yaw_follows_its_keys():
    placing = Placing([_ball(path={**_KEYS, "yaws_deg": [0.0, 90.0, 90.0], "smooth": False})], _FLAT)
    assert np.allclose(placing.at(2.0)[0, :3, 0], [0, 0, -1], atol=1e-12)
    assert np.allclose(placing.at(1.5)[0, :3, 0], [np.sqrt(0.5), 0, -np.sqrt(0.5)])


def test_a_ball_rolls_without_slipping():
    """The point that touches the ground stands still while the ball passes over it."""
    path = {"times_s": [0.0, 10.0], "positions_m": [[0, 0, 0], [12, 0, 5]], "smooth": False, "rolls": True}
    placing = Placing([_ball(path=path, size_m=[0.8, 0.8, 0.8])], _FLAT)
    now, soon = placing.at(3.3)[0], placing.at(3.3 + 1e-4)[0]
    centre = (now @ [0, 0.4, 0, 1])[:3]
    assert np.allclose(centre, [12 * 0.33, 0.4, 5 * 0.33])
    touching = np.linalg.inv(now) @ [centre[0], 0.0, centre[2], 1]
    assert np.linalg.norm(((soon - now) @ touching)[:3]) / 1e-4 < 1e-2
    top = np.linalg.inv(now) @ [centre[0], 0.8, centre[2], 1]
    assert np.linalg.norm(((soon - now) @ top)[:3]) / 1e-4 == pytest.approx(2.6, rel=1e-2)
    assert np.allclose(now[:3, :3] @ now[:3, :3].T, np.eye(3))


def test_a_program_moves_objects_by_name():
    matrix = np.eye(4)
    matrix[:3, 3] = 7, 8, 9
    placing = Placing([_ball()], _FLAT, {"ball": lambda t: (t, 1.0, 0.0)})
    assert placing.moving == [True]
    assert np.allclose(placing.at(2.5)[0, :3, 3], [2.5, 1.0, 0.0])
    assert np.allclose(Placing([_ball()], _FLAT, {"ball": lambda _: matrix}).at(0.0)[0], matrix)


@pytest.mark.parametrize("wrong", [np.zeros((4, 4)), np.diag([3.0, 3.0, 3.0, 1.0]), np.diag([1.0, 1.0, -1.0, 1.0])])
def test_a_matrix_that_does_more_than_turn_and_move_is_told(wrong):
    with pytest.raises(InputError, match="scripts: ball: must be a matrix that only turns and moves"):
        Placing([_ball()], _FLAT, {"ball": lambda _: wrong}).at(0.0)


@pytest.mark.parametrize("wrong", [(1.0, 2.0), (np.nan, 0.0, 0.0), np.zeros((3, 3))])
def test_a_program_that_returns_nonsense_is_told(wrong):
    with pytest.raises(InputError, match="scripts: ball: must be 3 finite numbers"):
        Placing([_ball()], _FLAT, {"ball": lambda _: wrong}).at(0.0)


def test_a_script_for_nobody_is_told():
    with pytest.raises(InputError, match="no object of the scene is named 'bull'"):
        Placing([_ball()], _FLAT, {"bull": lambda _: (0, 0, 0)})


@pytest.mark.parametrize(
    ("path", "told"),
    [
        ({"times_s": [0.0], "positions_m": [[0, 0, 0]]}, "times_s"),
        ({"times_s": [0.0, 2.0, 1.0], "positions_m": [[0, 0, 0]] * 3}, "must rise from key to key"),
        ({"times_s": [0.0, 1.0], "positions_m": [[0, 0, 0]]}, "one for each of the 2 times_s"),
        ({"times_s": [0.0, 1.0], "positions_m": [[0, 0, 0]] * 2, "yaws_deg": [1.0]}, "yaws_deg must hold"),
    ],
)
def test_paths_that_are_none_are_refused(path, told):
    with pytest.raises(ValidationError, match=told):
        _ball(path=path)


def test_a_helicopter_flies_its_circle():
    wind = Helicopter(kind="helicopter", centre_m=(3.0, -2.0), radius_m=5.0, height_m=6.0, period_s=8.0)
    things, scripts = helicopters([wind], _FLAT)
    placing = Placing(things, _FLAT, scripts)
    for t in (0.0, 2.0, 5.0):
        angle = 2 * np.pi * t / 8
        cabin = placing.at(t)[0] @ [0, 0.5 * things[0].size_m[1], 0, 1]
        assert np.allclose(cabin[:3], [3 + 5 * np.cos(angle), 6.0, -2 + 5 * np.sin(angle)])
    ahead = placing.at(0.0)[0, :3, 0]
    assert ahead[2] > 0.95
    assert helicopters([wind.model_copy(update={"drawn": False})], _FLAT) == ((), {})


def test_pitch_lifts_the_front_roll_leans_to_the_right_and_yaw_comes_last():
    def turned(**keys):
        thing = _ball(**keys)
        return Placing([thing], _FLAT).at(0.0)[0, :3, :3].round(9) + 0.0

    front, right, up = -np.eye(3)[2], np.eye(3)[0], np.eye(3)[1]
    np.testing.assert_array_equal(turned(pitch_deg=90) @ front, up)
    np.testing.assert_array_equal(turned(roll_deg=90) @ up, right)
    np.testing.assert_array_equal(turned(yaw_deg=90) @ right, front)
    # rolled about its own front, then lifted, then turned to the left
    np.testing.assert_array_equal(turned(yaw_deg=90, pitch_deg=90, roll_deg=90) @ up, front)
    np.testing.assert_array_equal(turned(yaw_deg=90, pitch_deg=90, roll_deg=90) @ front, up)


def test_more_keys_of_rolling_paths_than_there_is_room_for_are_refused(monkeypatch):
    monkeypatch.setattr(placing, "_MOST_ROLLING_KEYS", 7)
    path = {"times_s": [0.0, 1.0], "positions_m": [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]}
    ball = {"kind": "sphere", "position_m": [0.0, 0.0, 0.0]}
    scene = small_scene(object=[{**ball, "path": {**path, "rolls": k % 2 == 0}} for k in range(8)])
    with pytest.raises(InputError, match=r"paths that roll must have at most 7 keys together \(got 8\)"):
        Placing(scene.object, HeightField.of(scene))
