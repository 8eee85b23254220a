"""Per-blade culling and compaction on the GPU: blades of a page that a view shows, in order, for an indirect draw."""

from collections.abc import Mapping

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.culling.chunks import CHUNK, ChunkRange, ChunkTable
from greensward.culling.compaction import DRAW_COMMAND, Compaction
from greensward.gpu.buffers import at_least, read_back, release_all, zeros
from greensward.gpu.device import Device
from greensward.gpu.kernels import Kernel, Resource
from greensward.gpu.view import View
from greensward.scene import Culling
from greensward.sowing import Page, UnstoredPage

_FLAGS = ("orientation", "frustum")


def distance_defines(tests: Culling) -> Mapping[str, object]:
    """Defines of every shader that includes culling/level_of_detail.glsl."""
    return {} if tests.distance else {"ALL_DISTANCES": 1}


def test_defines(tests: Culling, purpose: str, occlusion: bool) -> Mapping[str, object]:
    """Defines of a shader that includes culling/visibility.glsl. With `occlusion`, pictures have a depth pyramid."""
    defines = {**distance_defines(tests), **{name.upper(): 1 for name in _FLAGS if getattr(tests, name)}}
    if purpose == "shadow":
        return {**defines, "SHADOW": 1}
    return {**defines, "OCCLUSION": 1} if occlusion else defines


def width_from(path: str) -> Mapping[str, str]:
    """Generated include with the file that culling/visibility.glsl takes `widthOf` from."""
    return {"culling/width": f'#include "{path}"'}


class BladeCulling:
    """Tests blades, counts and compacts those that survive; nothing is read back, and buffers only grow.

    `width` is the path of a technique's GLSL with `float widthOf(Blade, BladeBounds)`: the width in metres as drawn,
    within which of its curve everything lies; 0 where nothing shows because it is seen edge-on, below 0 where the
    technique has left the blade out. A kernel of the technique that includes culling/compaction.glsl then writes what
    it needs of each survivor to its place. With `occlusion`, pictures have a depth pyramid.
    """

    def __init__(
        self, device: Device, bindings: Mapping[str, Resource], tests: Culling, width: str, occlusion: bool
    ) -> None:
        self._device = device
        self._cull = {
            purpose: Kernel(
                device,
                "culling/cull_blades.comp",
                test_defines(tests, purpose, occlusion),
                bindings,
                generated=width_from(width),
            )
            for purpose in ("picture", "shadow")
        }
        self._compaction = Compaction(device)
        self.commands: moderngl.Buffer = zeros(device, DRAW_COMMAND.dtype.itemsize)
        """A draw command for each run that was culled, bound as `Commands`; another one when it must grow."""

    def make_room(self, runs: int, chunks: int) -> None:
        """Make room for a frame in which so many runs are culled, none of more than so many chunks."""
        device = self._device
        self.commands = at_least(
            device, self.commands, runs * DRAW_COMMAND.dtype.itemsize, DRAW_COMMAND.dtype.itemsize
        )
        self._compaction.make_room(chunks)

    def cull(
        self, page: Page | UnstoredPage, blades: ChunkRange, chunks: ChunkTable, view: View, command: int
    ) -> None:
        """Test the blades of a page in these chunks, and write the draw command of the survivors."""
        self._cull[view.purpose].run(
            blades.groups,
            **page.bindings,
            Chunks=chunks.buffer,
            Masks=self._compaction.masks,
            first_chunk=blades.first,
            chunk_count=blades.count,
        )
        self._compaction.sum_up(blades.count, self.commands, command)

    @property
    def compacted(self) -> dict[str, Resource]:
        """Buffers that culling/compaction.glsl reads, of the run that was culled last."""
        return self._compaction.bindings

    def survivors(self) -> npt.NDArray[np.uint32]:
        """Blades that survived, of every command, read back."""
        commands: npt.NDArray[np.void] = np.frombuffer(read_back(self._device, self.commands), DRAW_COMMAND.dtype)
        result: npt.NDArray[np.uint32] = commands["survivors"]
        return result

    def release(self) -> None:
        """Free the GPU resources."""
        release_all(*self._cull.values(), self._compaction, self.commands)


assert CHUNK == 32, "a chunk's mask has 32 bits"
