"""Objects of a shape and level are one draw whatever their sizes, and have the surface of their own."""

import numpy as np
import pytest
from PIL import Image

from greensward.gpu.kernels import Draw
from greensward.library import load
from greensward.scene import InputError, SurfaceClass
from reprojection import world_points
from small_scenes import small_scene


@pytest.fixture
def draw_calls(monkeypatch):
    """Files of the programs that drew, one for each call."""
    calls, run = [], Draw.run
    monkeypatch.setattr(Draw, "run", lambda self, *a, **o: (calls.append(self.path), run(self, *a, **o))[1])
    return calls


def test_the_fence_of_the_meadow_is_a_handful_of_draws(renderer, draw_calls):
    scene = load("meadow")
    bare = {"grass": (), "flowers": (), "shadows": scene.shadows.model_copy(update={"enabled": False})}
    drawn = renderer(scene.model_copy(update=bare))
    assert len({each.size_m for each in drawn._world.objects if each.kind == "box"}) > 50
    frame = drawn.render(aovs=["class"])
    assert (frame.truth["class"] == SurfaceClass.OBJECT).mean() > 0.01
    assert 0 < sum(path.startswith("passes/solids/") for path in draw_calls) <= 3


_SIZES = [(0.6, 1.4, 0.8), (1.0, 0.5, 1.2), (0.4, 0.4, 0.4)]


def test_ellipsoids_of_one_draw_have_each_its_surface_and_normals(renderer, draw_calls):
    balls = [
        {"kind": "sphere", "position_m": [1.3 * (i - 1), 0.2, 0.0], "size_m": size, "yaw_deg": 30.0 * i}
        for i, size in enumerate(_SIZES)
    ]
    drawn = renderer(small_scene(grass=[], object=balls, shadows={"enabled": False}), size=(320, 180))
    truth = drawn.render(aovs=["class", "depth", "normal"]).truth
    levels = len(set(drawn._geometry._solids._seen(drawn._world.visible.views[0])[1]))
    assert draw_calls.count("passes/solids/solid.frag") == levels <= 3
    shown = truth["class"] == SurfaceClass.OBJECT
    points, normals = world_points(drawn, drawn.scene.camera, truth["depth"])[shown], truth["normal"][shown]
    of = np.argmin(np.abs(points[:, :1] - 1.3 * np.array([-1, 0, 1])), axis=1)
    for i, size in enumerate(_SIZES):
        placed, half = drawn._world.placed[i], 0.5 * np.array(size)
        own = (points[of == i] - placed[:3, 3]) @ placed[:3, :3] - [0.0, half[1], 0.0]
        assert len(own) > 100
        assert np.abs(np.linalg.norm(own / half, axis=1) - 1.0).max() < 0.02
        expected = own / half**2 @ placed[:3, :3].T
        expected /= np.linalg.norm(expected, axis=1, keepdims=True)
        assert np.quantile((normals[of == i] * expected).sum(1), 0.05) > 0.995


CARD = "mtllib a.mtl\nusemtl a\nv -2 0 0\nv 2 0 0\nv 2 4 0\nv -2 4 0\nvt 0 0\nvt 2 0\nvt 2 1\nvt 0 1\n"
CARD += "f 1/1 2/2 3/3 4/4\n"


def card(renderer, folder, library, picture=None, **keys):
    """Truth of a card of 4 × 4 m in the middle of the image, on which a picture lies twice side by side."""
    (folder / "a.obj").write_text(CARD)
    (folder / "a.mtl").write_text("newmtl a\n" + library)
    if picture is not None:
        Image.fromarray(picture).save(folder / "a.png")
    card = {"kind": "mesh", "file": "a.obj", "position_m": [0, 0, 0], **keys}
    camera = {"position_m": [0, 2, 5], "target_m": [0, 2, 0], "fov_y_deg": 43, "height_above_ground": False}
    scene = small_scene(grass=[], object=[card], camera=camera, shadows={"enabled": False}).in_folder(folder)
    return renderer(scene, size=(64, 36)).render(aovs=["class", "albedo"]).truth


def test_materials_are_drawn_and_cut_out_and_hidden_colours_never_show(renderer, tmp_path):
    picture = np.zeros((16, 16, 4), np.uint8)
    picture[:, :, :] = 255, 255, 255, 0  # white, where it is transparent
    picture[:8, :8], picture[8:, :8] = (188, 0, 0, 255), (0, 0, 255, 255)
    truth = card(renderer, tmp_path, "Kd 1 1 0.735\nmap_Kd a.png\n", picture)
    shown = truth["class"] == SurfaceClass.OBJECT
    assert shown[4:32, 15:22].all()
    assert shown[4:32, 33:38].all()
    assert not shown[:, 25:31].any()
    assert not shown[:, 42:].any()
    albedo = truth["albedo"]
    np.testing.assert_allclose(albedo[6:15, 16:22], np.broadcast_to([0.503, 0, 0], (9, 6, 3)), atol=0.02)
    np.testing.assert_allclose(albedo[22:31, 16:22], np.broadcast_to([0, 0, 0.5], (9, 6, 3)), atol=0.02)
    assert albedo[shown][:, 1].max() < 0.05  # no white, also at edges


def test_a_material_without_a_picture_has_its_colour_and_the_scene_wins(renderer, tmp_path):
    truth = card(renderer, tmp_path, "Kd 0 0.735 0\n")
    np.testing.assert_allclose(truth["albedo"][18, 32], [0, 0.5, 0], atol=0.01)
    truth = card(renderer, tmp_path, "map_Kd gone.png\n", colour="#ff0000")
    red, green, blue = truth["albedo"][18, 32]
    assert red > 0.5 > 0.01 > max(green, blue)


@pytest.mark.parametrize("kind", ["box", "sphere", "cylinder"])
def test_an_object_has_the_colour_that_it_is_given_unless_it_is_weathered(renderer, kind):
    shape = {"kind": kind, "position_m": [0.0, 0.0, 0.0], "size_m": [1.5, 1.5, 1.5], "colour": "#808080"}
    spread = []
    for weathered in ({}, {"weathered": 1.0}):
        truth = (
            renderer(small_scene(grass=[], object=[{**shape, **weathered}])).render(aovs=["class", "albedo"]).truth
        )
        albedo = truth["albedo"][truth["class"] == SurfaceClass.OBJECT]
        assert albedo.mean() == pytest.approx(0.216, abs=0.03)
        spread.append(np.ptp(albedo))
    assert spread[0] < 0.002
    assert spread[1] > 0.05


def test_hundreds_of_solids_are_a_draw_for_each_kind_and_level_and_those_out_of_view_none(renderer, draw_calls):
    kinds = [
        {"kind": "box"},
        {"kind": "sphere", "size_m": [0.2, 0.3, 0.2]},
        {"kind": "capsule", "radius_m": 0.1},
        {"kind": "cylinder"},
    ]
    things = [
        {**kinds[k % 4], "position_m": [0.4 * (k % 40) - 8.0, 0.0, -0.5 * (k // 40)], "yaw_deg": 1.0 * (k % 90)}
        for k in range(400)
    ]
    for k, thing in enumerate(things[2::4]):
        thing["length_m"] = 0.3 + 0.01 * k
    behind = [{"kind": "box", "position_m": [0.0, 0.0, 30.0 + k]} for k in range(100)]
    drawn = renderer(small_scene(grass=[], object=things + behind, shadows={"enabled": False}), size=(320, 180))
    drawn.render()
    solids = drawn._geometry._solids
    seen, level = solids._seen(drawn._world.visible.views[0])
    assert draw_calls.count("passes/solids/solid.frag") == len(np.unique(level)) <= 25
    assert 100 < len(seen) < 400
    assert seen.max() < 400
    assert len(solids._levels) == 1 + 3 * 8


def test_the_coarser_the_level_the_smaller_is_what_is_round(renderer):
    balls = [{"kind": "sphere", "position_m": [0.0, 0.0, -2.0 * k]} for k in range(40)]
    drawn = renderer(small_scene(grass=[], object=balls, shadows={"enabled": False}), size=(320, 180))
    drawn.render()
    view = drawn._world.visible.views[0]
    seen, level = drawn._geometry._solids._seen(view)
    triangles = np.array([each.mesh.indices.size for each in drawn._geometry._solids._levels])[level]
    depth = -(drawn._world.placed[seen, 2, 3] - view.camera_ws[2])
    assert (np.diff(triangles[np.argsort(depth)]) <= 0).all()
    assert len(np.unique(triangles)) > 3


def test_a_long_capsule_has_its_own_length_and_round_ends(renderer):
    rod = {"kind": "capsule", "position_m": [0.0, 0.0, 0.0], "radius_m": 0.2, "length_m": 1.6}
    drawn = renderer(small_scene(grass=[], object=[rod], shadows={"enabled": False}), size=(320, 180))
    truth = drawn.render(aovs=["class", "depth"]).truth
    points = world_points(drawn, drawn.scene.camera, truth["depth"])[truth["class"] == SurfaceClass.OBJECT]
    axis = np.clip(points[:, 1], 0.2, 1.4)
    off = np.linalg.norm(points - np.stack([0 * axis, axis, 0 * axis], axis=1), axis=1)
    assert len(points) > 500
    assert np.abs(off - 0.2).max() < 0.01
    assert points[:, 1].max() > 1.55


def test_a_mesh_that_does_not_fit_is_refused(renderer, tmp_path, monkeypatch):
    monkeypatch.setattr("greensward.passes.solids.available_bytes", lambda device: 100)
    with pytest.raises(InputError, match=r"object\[0\].file: .* triangles .* GiB; simplify it"):
        card(renderer, tmp_path, "Kd 1 1 1\n")
