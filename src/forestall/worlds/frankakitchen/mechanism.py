"""FrankaKitchen's model in MuJoCo: the arm goes to a handle and stays with it, its joint is driven.

Called by `world`; calls mujoco. The arm is moved by its own position controllers, towards what
damped least squares say, and its contacts are off: nothing is grasped, and nothing is knocked over.
A fixture moves by a force at its joint, against its friction, damping and stops, and takes along
what the model couples to it.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from forestall.types.observation import Vec3
from forestall.worlds.frankakitchen.fixtures import Fixture

Array = npt.NDArray[np.float64]

ARM = 7
HOME_RAD = (0.15, -1.76, 1.84, -2.48, 0.26, 0.71, 1.6)
HAND, ROBOT = "end_effector", "panda0_link0"
BESIDE_M = (0.0, -0.04, 0.0)
"""Where the hand is beside a handle: on the robot's side of it."""

REACH_S, MOVE_S, SETTLE_S = 2.0, 2.0, 0.5
STIFFNESS, DAMPING, AGAINST, NEAR, MOST = 400.0, 40.0, 10.0, 0.005, 80.0
"""Of the force at a joint, at most `MOST` N or N m: 1/s² and 1/s of its inertia, 1/s of its own
damping, and where its friction is made up for in full, in radians or metres."""


class Mechanism:
    """The model and its state.

    Args:
        file: of the model.
    """

    def __init__(self, file: Path) -> None:
        import mujoco

        self._mujoco = mujoco
        self._model = mujoco.MjModel.from_xml_path(str(file))
        self._data = mujoco.MjData(self._model)
        self._hand = self._site(HAND)
        self._low, self._high = self._model.jnt_range[:ARM].T
        robot = {self._model.body(ROBOT).id}
        for body in range(self._model.nbody):
            if self._model.body_parentid[body] in robot:
                robot.add(body)
        own = np.isin(self._model.geom_bodyid, list(robot))
        self._model.geom_contype[own] = self._model.geom_conaffinity[own] = 0

    def reset(self, positions: dict[Fixture, float], sway: Array) -> None:
        """Put everything in its place: the arm at home, a little off it, every joint as said."""
        self._mujoco.mj_resetData(self._model, self._data)
        self._data.qpos[:ARM] = self._data.ctrl[:ARM] = np.asarray(HOME_RAD) + sway
        for fixture, position in positions.items():
            self._data.qpos[self._joint(fixture).qposadr[0]] = position
        self._mujoco.mj_forward(self._model, self._data)

    @property
    def time_s(self) -> float:
        """Simulated time."""
        return float(self._data.time)

    def wait(self, seconds: float) -> None:
        """Let time pass."""
        self._steps(seconds)

    def position(self, fixture: Fixture) -> float:
        """Where a fixture's joint stands."""
        return float(self._data.qpos[self._joint(fixture).qposadr[0]])

    def place(self, fixture: Fixture) -> Vec3:
        """Where it is handled."""
        return _vec(self._data.site_xpos[self._site(fixture.site)])

    def body(self, name: str) -> Vec3:
        """Where a body is."""
        return _vec(self._data.xpos[self._model.body(name).id])

    @property
    def hand_world_m(self) -> Vec3:
        """Where the hand is."""
        return _vec(self._data.site_xpos[self._hand])

    def reach(self, fixture: Fixture) -> float:
        """Bring the hand beside a handle; how far off it is then, in metres."""
        target = np.asarray(self.place(fixture)) + BESIDE_M
        goal, start = self._inverse(target), self._data.ctrl[:ARM].copy()
        count = self._count(REACH_S)
        for step in range(count):
            self._data.ctrl[:ARM] = start + (goal - start) * min(1.0, (step + 1) / (0.7 * count))
            self._mujoco.mj_step(self._model, self._data)
        for step in range(self._count(SETTLE_S)):  # what gravity pulls it off
            if step % 10 == 0:
                self._follow(fixture)
            self._mujoco.mj_step(self._model, self._data)
        return float(np.linalg.norm(target - self._data.site_xpos[self._hand]))

    def move(self, fixture: Fixture, goal: float) -> None:
        """Drive a fixture's joint to a position, the hand beside its handle; then home."""
        joint, start = self._joint(fixture), self.position(fixture)
        count = self._count(MOVE_S)
        for step in range(count + self._count(SETTLE_S)):
            wanted = start + (goal - start) * min(1.0, (step + 1) / (0.8 * count))
            speed = (goal - start) / (0.8 * MOVE_S) if step < 0.8 * count else 0.0
            self._data.qfrc_applied[joint.dofadr[0]] = self._force(joint, wanted, speed)
            if step % 10 == 0:
                self._follow(fixture)
            self._mujoco.mj_step(self._model, self._data)
        self._data.qfrc_applied[joint.dofadr[0]] = 0.0
        self._home()

    def _force(self, joint: Any, wanted: float, speed: float) -> float:
        dof = joint.dofadr[0]
        inertia, damping = self._model.dof_M0[dof], self._model.dof_damping[dof]
        error = wanted - self._data.qpos[joint.qposadr[0]]
        force = inertia * (STIFFNESS * error - DAMPING * (self._data.qvel[dof] - speed))
        force += damping * (speed + AGAINST * error)
        force += self._model.dof_frictionloss[dof] * np.clip(error / NEAR, -1.0, 1.0)
        return float(np.clip(force, -MOST, MOST))

    def set(self, fixture: Fixture, position: float) -> None:
        """Somebody else moves it."""
        joint = self._joint(fixture)
        self._data.qpos[joint.qposadr[0]], self._data.qvel[joint.dofadr[0]] = position, 0.0
        self._mujoco.mj_forward(self._model, self._data)

    def _home(self) -> None:
        start, count = self._data.ctrl[:ARM].copy(), self._count(REACH_S)
        for step in range(count):
            share = min(1.0, (step + 1) / (0.7 * count))
            self._data.ctrl[:ARM] = start + (np.asarray(HOME_RAD) - start) * share
            self._mujoco.mj_step(self._model, self._data)

    def _follow(self, fixture: Fixture) -> None:
        target = np.asarray(self.place(fixture)) + BESIDE_M
        error = target - self._data.site_xpos[self._hand]
        turn = self._towards(self._data, error * 0.3)
        self._data.ctrl[:ARM] = np.clip(self._data.ctrl[:ARM] + turn, self._low, self._high)

    def _inverse(self, target: Array) -> Array:
        """Joint angles for a place of the hand, by damped least squares from home."""
        scratch = self._mujoco.MjData(self._model)
        scratch.qpos[:] = self._data.qpos
        scratch.qpos[:ARM] = HOME_RAD
        for _ in range(200):
            self._mujoco.mj_kinematics(self._model, scratch)
            self._mujoco.mj_comPos(self._model, scratch)
            error = target - scratch.site_xpos[self._hand]
            length = float(np.linalg.norm(error))
            if length < 0.003:
                break
            turn = self._towards(scratch, error * min(1.0, 0.1 / length))
            scratch.qpos[:ARM] = np.clip(scratch.qpos[:ARM] + turn, self._low, self._high)
        return np.array(scratch.qpos[:ARM])

    def _towards(self, data: Any, error: Array) -> Array:
        jacobian = np.zeros((3, self._model.nv))
        self._mujoco.mj_jacSite(self._model, data, jacobian, None, self._hand)
        own = jacobian[:, :ARM]
        solved: Array = own.T @ np.linalg.solve(own @ own.T + 1e-3 * np.eye(3), error)
        return solved

    def _steps(self, seconds: float) -> None:
        for _ in range(self._count(seconds)):
            self._mujoco.mj_step(self._model, self._data)

    def _count(self, seconds: float) -> int:
        return int(seconds / self._model.opt.timestep + 0.5)

    def _site(self, name: str) -> int:
        return int(self._model.site(name).id)

    def _joint(self, fixture: Fixture) -> Any:
        return self._model.joint(fixture.joint)


def _vec(point: Array) -> Vec3:
    x, y, z = (float(v) for v in point)
    return (x, y, z)
