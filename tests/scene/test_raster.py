"""Arrays in scenes: compared by content, copied, pickled, drawn as files are, and never written into TOML."""

import copy
import pickle

import numpy as np
import pytest
from pydantic import ValidationError

from greensward.ground import HeightField
from greensward.io.rasters import read_rgba
from greensward.scene import HeightMapGround, InputError, Scene, Sowing
from greensward.scene.load import dump, named_files
from greensward.scene.raster import Raster

HILL = np.add.outer(np.arange(4.0), np.arange(6.0))
MASK = np.array([[0, 255], [51, 102]], np.uint8)


def scene(heights=HILL, mask=MASK):
    return Scene(ground=HeightMapGround(array=heights, size_m=(10, 6)), sowing=Sowing(density_map=mask))


def test_scenes_with_arrays_are_compared_hashed_copied_and_pickled_by_content():
    one, same, other = scene(), scene(HILL.copy(), MASK.copy()), scene(HILL + 1)
    assert one == same
    assert one != other
    assert one.ground == pickle.loads(pickle.dumps(one)).ground
    assert hash(one.ground) == hash(same.ground) != hash(other.ground)
    for twin in (copy.deepcopy(one), one.model_copy(deep=True)):
        assert twin == one
    assert named_files(one, {}) == []
    assert one.model_dump()["sowing"]["density_map"] == Raster(MASK)


def test_what_a_scene_holds_does_not_change_with_the_array_it_was_made_of():
    mine = HILL.copy()
    held = scene(mine)
    mine[:] = 9
    assert held == scene()
    assert held.ground.array is not None
    with pytest.raises(ValueError, match="read-only"):
        held.ground.array.values[0, 0] = 1


def test_heights_of_an_array_are_metres_and_its_holes_are_filled():
    holed = HILL.copy()
    holed[1, 1] = np.nan
    field = HeightField.of(scene(holed))
    assert field.size_m == (10, 6)
    assert field.heights[3, 5] == 8
    assert field.heights[1, 1] == pytest.approx(2, abs=1)
    masked = np.ma.masked_array(np.where(np.isnan(holed), -9999.0, HILL), np.isnan(holed))
    assert np.array_equal(HeightField.of(scene(masked)).heights, field.heights), "as rasterio reads what is hidden"
    stretched = HeightMapGround(array=HILL.astype(np.int16), height_m=(10, 18))
    assert HeightField.of(Scene(ground=stretched)).highest_m == 18


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        (MASK, [51, 51, 51, 255]),
        (MASK / 255, [51, 51, 51, 255]),
        (MASK > 50, [255, 255, 255, 255]),
        (np.dstack([MASK, MASK, MASK, MASK]), [51, 51, 51, 51]),
        (np.dstack([MASK, MASK // 3, MASK]), [51, 17, 51, 255]),
    ],
)
def test_maps_of_an_array(given, expected):
    density_map = Sowing(density_map=given).density_map
    assert isinstance(density_map, Raster)
    assert read_rgba(density_map)[1, 0].tolist() == expected


@pytest.mark.parametrize(
    ("make", "told"),
    [
        (lambda: HeightMapGround(), "file: is missing and has no default"),
        (lambda: HeightMapGround(file="a.tif", array=HILL), "file: must not stand beside array"),
        (lambda: HeightMapGround(array=HILL[0]), r"must have 2 dimensions, rows and columns \(got 1\)"),
        (lambda: HeightMapGround(array=HILL.astype(str)), "must be an array of plain numbers"),
        (lambda: HeightMapGround(array="a.tif"), "must be an array of NumPy, which only Python can give"),
        (lambda: Sowing(density_map=MASK.astype(np.int32)), r"must hold floats from 0 to 1, or uint8 \(got int32\)"),
        (lambda: Sowing(density_map=MASK * 1.0), r"must hold floats from 0 to 1, or uint8 \(got 0 to 255\)"),
        (lambda: Sowing(density_map=np.zeros((2, 2, 2))), r"must have the shape \(rows, columns\) or"),
        (lambda: Sowing(density_map=5), "density_map"),
    ],
)
def test_an_array_that_cannot_be_used_is_refused(make, told):
    with pytest.raises((ValidationError, InputError), match=told):
        make()


def test_a_scene_with_an_array_is_not_saved():
    with pytest.raises(InputError, match=r"^array: is an array, which TOML cannot hold; save it as a picture or by"):
        dump(Scene(ground=HeightMapGround(array=HILL)))
    with pytest.raises(InputError, match=r"^density_map: is an array"):
        dump(Scene(sowing=Sowing(density_map=MASK)))
