"""Per blade on the GPU: which blades of a page a view shows, in order, without gaps, for an indirect draw."""

from collections.abc import Mapping

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.culling.chunks import CHUNK, ChunkTable, Span, at_least
from greensward.gpu.program import build_compute
from greensward.gpu.view import View
from greensward.scene import Culling
from greensward.sowing import Page, UnstoredPage

CHUNKS = 2
MASKS, KEPT, STARTS, COMMANDS = range(8, 12)
"""Shader-storage bindings; a technique that looks up places binds none of them, as `sift` leaves them bound."""
_FLAGS = ("orientation", "frustum")
_FAN = 64  # of tally.comp
_COMMAND_BYTES = 20


def distance_defines(tests: Culling) -> Mapping[str, object]:
    """What every shader is built with that includes culling/presence.glsl."""
    return {} if tests.distance else {"ALL_DISTANCES": 1}


def test_defines(tests: Culling, purpose: str, hiding: bool) -> Mapping[str, object]:
    """What a shader is built with that includes culling/shows.glsl. With `hiding`, pictures have a pyramid."""
    defines = {**distance_defines(tests), **{name.upper(): 1 for name in _FLAGS if getattr(tests, name)}}
    if purpose == "shadow":
        return {**defines, "SHADOW": 1}
    return {**defines, "OCCLUSION": 1} if hiding else defines


def width_from(path: str) -> Mapping[str, str]:
    """The file that culling/shows.glsl takes `widthOf` from, as a generated include."""
    return {"culling/width": f'#include "{path}"'}


class Sieve:
    """Tests blades and counts those that stay; nothing is read back, and buffers only grow.

    `width` is the path of a technique's GLSL with `float widthOf(Blade, Hull)`: the width in metres as drawn, within
    which of its curve everything lies; 0 where nothing shows because it is seen edge-on, below 0 where the
    technique has left the blade out. A compute shader of the technique that includes culling/places.glsl then
    writes what it needs of each blade kept to its place. With `hiding`, pictures have a pyramid.
    """

    def __init__(self, ctx: moderngl.Context, tests: Culling, width: str, hiding: bool) -> None:
        self._ctx = ctx
        self._sift = {
            purpose: build_compute(ctx, "culling/sift.comp", test_defines(tests, purpose, hiding), width_from(width))
            for purpose in ("picture", "shadow")
        }
        self._tally = build_compute(ctx, "culling/tally.comp")
        self._masks, self._kept, self._starts = (ctx.buffer(bytes(4)) for _ in range(3))
        self._commands = ctx.buffer(bytes(_COMMAND_BYTES))

    def make_room(self, runs: int, chunks: int) -> None:
        """For a frame in which so many runs are sifted, none of more than so many chunks."""
        self._commands = at_least(self._ctx, self._commands, runs * _COMMAND_BYTES)
        self._kept = at_least(self._ctx, self._kept, chunks * 4)
        # a level above has a 64th of the items, and at least one
        self._starts = at_least(self._ctx, self._starts, (chunks + chunks // 32 + 8) * 4)
        if self._masks.size < chunks * 4:
            self._masks = at_least(self._ctx, self._masks, chunks * 4)
            self._masks.write(bytes(self._masks.size))

    def sift(self, page: Page | UnstoredPage, span: Span, chunks: ChunkTable, view: View, command: int) -> None:
        """Test the blades of a page in these chunks; the draw command of this number becomes that of those kept.

        The block of the view and the sward must be bound, and for a picture its pyramid.
        """
        page.bind()
        chunks.bind(CHUNKS)
        buffers = (self._masks, self._kept, self._starts, self._commands)
        for binding, buffer in zip((MASKS, KEPT, STARTS, COMMANDS), buffers, strict=True):
            buffer.bind_to_storage_buffer(binding)
        shader = self._sift[view.purpose]
        shader["firstChunk"] = span.first
        shader["chunkCount"] = span.count
        shader.run(*span.groups)
        self._count(span.count, command)

    def _count(self, items: int, command: int) -> None:
        self._tally["command"] = command
        start = 0
        while True:
            self._ctx.memory_barrier(moderngl.SHADER_STORAGE_BARRIER_BIT)
            blocks = -(-items // _FAN)
            self._tally["items"] = items
            self._tally["start"] = start
            self._tally.run(-(-blocks // 64))
            if items <= _FAN:
                break
            start, items = start + items, blocks
        self._ctx.memory_barrier(moderngl.SHADER_STORAGE_BARRIER_BIT | moderngl.COMMAND_BARRIER_BIT)

    def draw(self, array: moderngl.VertexArray, command: int) -> None:
        """An instance for every 32 blades kept; the vertices of the last that are too many, the shaders must drop.

        How many were kept is word 5 · command + 4 of the buffer that is bound to `COMMANDS` here.
        """
        self._commands.bind_to_storage_buffer(COMMANDS)
        array.render_indirect(self._commands, moderngl.PATCHES, 1, command)

    def kept(self) -> npt.NDArray[np.uint32]:
        """Blades kept of every command, read back."""
        self._ctx.memory_barrier(moderngl.BUFFER_UPDATE_BARRIER_BIT)
        words: npt.NDArray[np.uint32] = np.frombuffer(self._commands.read(), np.uint32).reshape(-1, 5)
        return words[:, 4]

    def release(self) -> None:
        """Free the GPU resources."""
        for shader in (*self._sift.values(), self._tally):
            shader.release()
        for buffer in (self._masks, self._kept, self._starts, self._commands):
            buffer.release()


assert CHUNK == 32, "a chunk's mask has 32 bits"
