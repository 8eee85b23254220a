"""Flower and seed heads at the tips of blades that carry one."""

import moderngl

from greensward.gpu.view import View
from greensward.world import World


class Heads:
    def __init__(self, ctx: moderngl.Context, world: World) -> None: ...
    def draw(self, view: View) -> None: ...
    def release(self) -> None: ...
