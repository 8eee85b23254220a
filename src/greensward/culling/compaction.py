"""Stream compaction: the place of each marked item among all marked ones, by a prefix sum."""

import moderngl

from greensward.gpu.buffers import at_least, clear, release_all, zeros
from greensward.gpu.device import COMMANDS_WRITTEN, STORAGE_WRITTEN, Device
from greensward.gpu.kernels import Kernel, Resource
from greensward.gpu.layouts import WORD, struct

# the first four are OpenGL's; survivors: blades that are drawn, of which the last instance may have fewer than 32
DRAW_COMMAND = struct(
    "DrawCommand",
    ("vertices", "uint"),
    ("instances", "uint"),
    ("first_vertex", "uint"),
    ("first_instance", "uint"),
    ("survivors", "uint"),
)
_FAN = 64  # of prefix_sum.comp


class Compaction:
    """Marks of items, 32 to a word, and the sums of those before each word; read by culling/survivors.glsl."""

    def __init__(self, device: Device) -> None:
        self._device = device
        self._prefix_sum = Kernel(device, "culling/prefix_sum.comp")
        self.masks: moderngl.Buffer = zeros(device, WORD)
        """Bits to be set before `sum_up`, which clears them; another buffer when it must grow."""
        self._survivors, self._offsets = (zeros(device, WORD) for _ in range(2))

    def make_room(self, words: int) -> None:
        """Make room for so many words."""
        device = self._device
        self._survivors = at_least(device, self._survivors, words * WORD)
        # a level above has a 64th of the items, and at least one
        self._offsets = at_least(device, self._offsets, (words + words // 32 + 8) * WORD)
        if self.masks.size < words * WORD:
            self.masks = at_least(device, self.masks, words * WORD)
            clear(device, self.masks, self.masks.size)

    def sum_up(self, words: int, commands: moderngl.Buffer, command: int) -> None:
        """Take over the marks, and write how many there are to the draw command of this number."""
        start, items = 0, words
        while True:
            self._device.ctx.memory_barrier(STORAGE_WRITTEN)
            blocks = -(-items // _FAN)
            self._prefix_sum.run_over(
                blocks,
                Masks=self.masks,
                Survivors=self._survivors,
                Offsets=self._offsets,
                Commands=commands,
                command=command,
                items=items,
                start=start,
            )
            if items <= _FAN:
                break
            start, items = start + items, blocks
        self._device.ctx.memory_barrier(COMMANDS_WRITTEN)

    @property
    def bindings(self) -> dict[str, Resource]:
        """Buffers that culling/survivors.glsl reads, of the items that were summed up last."""
        return {"Survivors": self._survivors, "Offsets": self._offsets}

    def release(self) -> None:
        """Free the GPU resources."""
        release_all(self._prefix_sum, self.masks, self._survivors, self._offsets)
