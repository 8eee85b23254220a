"""Generated image of bare soil with old thatch, seamless."""

from functools import lru_cache

import numpy as np
import numpy.typing as npt

from greensward.io.rasters import encoded


@lru_cache(maxsize=4)
def generated_soil(seed: int, edge_px: int = 512) -> npt.NDArray[np.uint8]:
    """sRGB soil, crumbs and straw, uint8 (edge, edge, 4), seamless at its edges."""
    random = np.random.default_rng(seed)
    frequency = np.fft.fftfreq(edge_px)
    radius = np.hypot(frequency[:, None], frequency[None, :])
    radius[0, 0] = 1.0

    def cloud(power: float) -> npt.NDArray[np.float64]:
        # white noise shaped in the frequency domain is periodic, hence seamless
        spectrum = np.fft.fft2(random.standard_normal((edge_px, edge_px))) / radius**power
        spectrum[0, 0] = 0.0
        field = np.fft.ifft2(spectrum).real
        result: npt.NDArray[np.float64] = field / field.std()
        return result

    broad, fine, crumbs = cloud(1.6), cloud(1.1), cloud(0.5)
    straw = np.zeros((edge_px, edge_px))
    count = 5200
    start = random.uniform(0, edge_px, (count, 2))
    angle = random.uniform(0, np.pi, count)
    length = random.uniform(5, 20, count)
    curl = random.normal(0.0, 0.006, count)
    shade = random.uniform(0.1, 0.9, count) ** 1.5
    for t in np.linspace(0.0, 1.0, 32):
        along = t * length
        turned = angle + curl * along
        x = (start[:, 0] + np.cos(turned) * along).astype(int) % edge_px
        y = (start[:, 1] + np.sin(turned) * along).astype(int) % edge_px
        for dy in (0, 1):
            np.maximum.at(straw, ((y + dy) % edge_px, x), shade * (1.0 - 0.4 * dy))
    dark, light = np.array([0.052, 0.036, 0.022]), np.array([0.16, 0.115, 0.07])
    thatch, moss = np.array([0.33, 0.25, 0.13]), np.array([0.055, 0.075, 0.022])
    tone = np.clip(0.45 + 0.16 * broad + 0.1 * fine + 0.1 * crumbs, 0.0, 1.0)[..., None]
    colour = dark + (light - dark) * tone
    green = np.clip(0.35 * (fine - 0.4 * broad), 0.0, 0.6)[..., None]
    colour += (moss - colour) * green
    colour += (thatch - colour) * (0.55 * straw * np.clip(0.7 + 0.25 * broad, 0.2, 1.0))[..., None]
    srgb = encoded(np.clip(colour, 0.0, 1.0))
    pixels = np.empty((edge_px, edge_px, 4), np.uint8)
    pixels[..., :3] = np.round(srgb * 255.0)
    pixels[..., 3] = 255
    pixels.setflags(write=False)  # shared by all that ask for it
    return pixels
