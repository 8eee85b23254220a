"""Density maps in, and warnings of those that cannot be meant."""

import warnings

import numpy as np
import pytest
from PIL import Image

from greensward.io.masks import read_mask

HALF = np.zeros((8, 8), np.uint8)
HALF[:, 4:] = 255
NONE, FULL = np.zeros_like(HALF), np.full_like(HALF, 255)


@pytest.mark.parametrize(
    ("channels", "with_heights", "told"),
    [
        ((HALF,), True, None),
        ((HALF, NONE, FULL), True, None),
        ((HALF, NONE, HALF, FULL), True, None),
        ((HALF, NONE, NONE), True, "blue, the height of the grass, is 0 wherever red, its density, is not"),
        ((HALF, NONE, NONE), False, None),
        ((FULL, FULL, FULL, HALF), True, "only its alpha varies, which a density map does not use; save the alpha"),
        ((HALF, HALF, HALF, HALF), True, None),
        ((HALF // 255,), True, "its greatest density is 1 of 255, so next to nothing grows; scale classes"),
        ((NONE,), True, None),
    ],
)
def test_a_mask_that_cannot_be_meant_is_warned_of(tmp_path, channels, with_heights, told):
    Image.fromarray(np.dstack(channels).squeeze()).save(tmp_path / "a.png")
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        pixels = read_mask(tmp_path / "a.png", with_heights)
    np.testing.assert_array_equal(pixels[..., 0], channels[0])
    assert len(found) == (told is not None)
    assert not told or str(found[0].message).startswith(f"{tmp_path / 'a.png'}: {told}")
