"""Blades stepped through time in the forms of Yan 2024 and Jahrmann & Wimmer 2017, in float64 (simulate.comp)."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from oracles import forces

Floats = npt.NDArray[np.float64]
FRAME_S = 1.0 / 60.0


@dataclass
class Blades:
    """Blades with a state; vectors are (n, 3), relative to the roots but for `root`, everything else (n,)."""

    root: Floats
    up: Floats
    front: Floats
    height: Floats
    stiffness: Floats
    tip: Floats
    pressed: Floats


@dataclass
class Steps:
    """A form with its constants, and what acts on blades.

    `winds` gives velocities that count by direction, and those of blasts, at points (n, 3) and a time. Each ball is
    its centre and radius, at a time.
    """

    form: str
    winds: Callable[[Floats, float], tuple[Floats, Floats]]
    gravity: float = 9.8
    forward: float = 0.25
    recovery_hz: float = 1.0
    reference_m: float = 0.0
    rise_s: float = 2.0
    centre: Floats | None = None
    towards: float = 1.0
    balls: Callable[[float], list[tuple[Floats, float]]] = lambda _: []

    def pull(self, root: Floats) -> Floats:
        """Direction of gravity at roots."""
        down = np.broadcast_to([0.0, -1.0, 0.0], root.shape)
        if self.centre is None:
            return down
        mixed = (1.0 - self.towards) * down + self.towards * _unit(self.centre - root)
        return _unit(mixed)

    def step(self, b: Blades, time_s: float, dt: float = FRAME_S) -> Floats:
        """Advance tips and collision strength to a time; returns control points."""
        wind, blast = self.winds(b.root, time_s)
        force = forces.wind_force(wind, blast, b.tip, b.up, b.height)
        size = (b.height / self.reference_m if self.reference_m else np.ones(len(b.height)))[:, None]
        bend = 1.0 - b.stiffness
        if self.form == "yan2024":
            moving = size * (forces.gravity_2024(self.gravity, self.forward, self.pull(b.root), b.front) + force)
            rate = b.stiffness * self.recovery_hz
        else:
            weight = forces.gravity_2017(self.gravity, self.forward, self.pull(b.root), b.front, b.height, bend)
            moving = weight + size * bend[:, None] * force
            rate = (1.0 - 0.25 * bend) * self.recovery_hz
        rate = rate * np.maximum(1.0 - b.pressed, 0.1)
        tip = forces.relaxed(b.tip, b.height[:, None] * b.up, moving, rate, dt)
        control, tip = forces.correct(b.up, b.height, tip)
        touched = np.zeros(len(tip), bool)
        for centre, radius in self.balls(time_s):
            move = _out(b.root + tip - centre, radius)
            move = move + 4.0 * _out(b.root + 0.5 * control + 0.25 * (tip + move) - centre, radius)
            away = np.linalg.norm(move, axis=1)
            move *= np.minimum(1.0, 2.0 * b.height / np.maximum(away, 1e-12))[:, None]
            tip = tip + move
            b.pressed = np.minimum(b.pressed + (np.linalg.norm(move, axis=1) / b.height) ** 2, 1.0)
            touched |= away > 0.0
        again, moved = forces.correct(b.up, b.height, tip)
        b.tip = np.where(touched[:, None], moved, tip)
        b.pressed = np.maximum(b.pressed - np.maximum(b.stiffness, 0.1) * dt / self.rise_s, 0.0)
        return np.where(touched[:, None], again, control)


def _unit(v: Floats) -> Floats:
    return np.asarray(v / np.linalg.norm(v, axis=-1, keepdims=True))


def _out(inward: Floats, radius: float) -> Floats:
    away = np.linalg.norm(inward, axis=1)
    return inward * np.maximum(radius / away - 1.0, 0.0)[:, None]


def fronts(up: Floats, facing: Floats) -> Floats:
    """Directions (n, 3) that blades face, turned about their up (shaders/blade.glsl)."""
    helper = np.where(np.abs(up[:, :1]) < 0.9, [[1.0, 0.0, 0.0]], [[0.0, 0.0, 1.0]])
    e1 = _unit(np.cross(helper, up))
    return np.cos(facing)[:, None] * e1 + np.sin(facing)[:, None] * np.cross(up, e1)
