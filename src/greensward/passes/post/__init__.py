"""Tone mapping: from radiance to a picture, averaged over samples and encoded."""

from dataclasses import dataclass
from typing import Literal, get_args

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.gpu.buffers import release_all
from greensward.gpu.device import Device, Stage
from greensward.gpu.full_screen import FullScreenPass
from greensward.gpu.kernels import Bindings
from greensward.scene import InputError
from greensward.scene.classes import SurfaceClass

Encoding = Literal["srgb", "linear", "hdr"]
"""Numbers of a picture: sRGB, the same in linear light, or radiance before exposure and tone curve."""


@dataclass(frozen=True)
class Look:
    """Parts of the scene that a picture shows, and their encoding."""

    encoding: Encoding = "srgb"
    sky: bool = True
    ground: bool = True

    def __post_init__(self) -> None:
        if self.encoding not in get_args(Encoding):
            raise InputError(f'encoding: must be "srgb", "linear" or "hdr" (got {self.encoding!r})')
        for name, value in (("sky", self.sky), ("ground", self.ground)):
            if value not in (True, False):
                raise InputError(f"{name}: must be True or False (got {value!r})")

    @property
    def is_whole(self) -> bool:
        """True if every pixel shows the scene."""
        return self.sky and self.ground

    @property
    def hidden(self) -> int:
        """Bits of the classes that are left out."""
        return (0 if self.sky else 1 << SurfaceClass.SKY) | (0 if self.ground else 1 << SurfaceClass.GROUND)


class Post:
    """Tone mapping, accumulation and encoding, by the look of the picture."""

    def __init__(
        self, device: Device, bindings: Bindings, size: tuple[int, int], stage: Stage | None, *, averaged: bool
    ) -> None:
        self._device, self._ctx = device, device.ctx
        self._stage, self._bindings, self._averaged = stage, bindings, averaged
        self._passes: dict[tuple[str, bool, bool], FullScreenPass] = {}
        self._tone(Look())
        self._encoding(Look())
        self._allocate(size)

    def _tone(self, look: Look) -> FullScreenPass:
        return self._pass("tone", ["f4"] if look.is_whole else ["f4", "f4"], look, look.encoding == "hdr")

    def _encoding(self, look: Look) -> FullScreenPass:
        return self._pass("encode", ["f1"], look, False)

    def _pass(self, name: str, dtypes: list[str], look: Look, radiance: bool) -> FullScreenPass:
        """The pass of a look. One that few programs want is compiled when it is first asked for."""
        key = name, radiance, look.is_whole
        if key not in self._passes:
            defines: dict[str, int] = {"AVERAGED": int(self._averaged)} if name == "tone" else {}
            defines |= {"RADIANCE": 1} if radiance else {}
            defines |= {} if look.is_whole else {"CUT_OUT": 1}
            self._passes[key] = FullScreenPass(
                self._device,
                f"passes/post/{name}.glsl",
                dtypes,
                stage=self._stage,
                defines=defines,
                bindings=self._bindings,
            )
        return self._passes[key]

    def _allocate(self, size: tuple[int, int]) -> None:
        self._average = [self._ctx.texture(size, 4, dtype="f4") for _ in range(2)]
        self._picture = self._ctx.texture(size, 4, dtype="f1")
        self._depths: list[moderngl.Texture] = []

    def accumulate(self, radiance: moderngl.Texture, sample: int, look: Look) -> moderngl.Texture:
        """Tone one sample; returns the average with those before it, or it alone if samples are not `averaged`.

        Where classes are left out, its alpha is the part of the samples that show something.
        """
        average, target = self._average[(sample + 1) % 2], self._average[sample % 2]
        if look.is_whole:
            self._tone(look).run(target, radiance=radiance, average=average)
            return target
        if not self._depths:
            self._depths = [self._ctx.texture(target.size, 4, dtype="f4") for _ in range(2)]
        before, now = self._depths[(sample + 1) % 2], self._depths[sample % 2]
        self._tone(look).run(target, now, radiance=radiance, average=average, shown_depth=before, hidden=look.hidden)
        self._shown_depth = now
        return target

    @property
    def shown_depth(self) -> moderngl.Texture:
        """Depth in metres of the nearest that the samples of a cut-out picture show, in red."""
        return self._shown_depth

    def encode(self, picture: moderngl.Texture, look: Look) -> moderngl.Texture:
        """Finish a toned picture: as sRGB in eight bits, or as it is in another encoding."""
        if look.encoding != "srgb":
            return picture
        self._encoding(look).run(self._picture, picture=picture)
        return self._picture

    def read(self) -> npt.NDArray[np.uint8]:
        """Read back the sRGB picture, (height, width, 3), top row first."""
        width, height = self._picture.size
        pixels = np.frombuffer(self._picture.read(), np.uint8).reshape(height, width, 4)
        return pixels[::-1, :, :3].copy()

    def resize(self, size: tuple[int, int]) -> None:
        """Make pictures of another size from now on."""
        self._free()
        self._allocate(size)

    def _free(self) -> None:
        release_all(*self._average, self._picture, *self._depths)

    def release(self) -> None:
        """Free the GPU resources."""
        self._free()
        release_all(*self._passes.values())
