"""A world seen through a sensor. Put around an environment by `assembly`; calls `sensor.py`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from forestall.domain.model import Domain
from forestall.seams.acting import Environment
from forestall.seams.around import Around
from forestall.sensors.sensor import Errors, Sensor
from forestall.types.observation import Observation, Vec3


class SensedWorld(Around):
    """Implements `Environment`: what is done is done in the world, what is seen is the sensor's.

    Args:
        environment: the world, with its faults.
        sensor: what the robot looks through.
    """

    def __init__(self, environment: Environment, sensor: Sensor) -> None:
        super().__init__(environment)
        self._sensor = sensor

    def reset(self, seed: int) -> None:
        """Reset world and sensor."""
        self._sensor.reset(seed)
        self._inner.reset(seed)

    def scan(self, thorough: bool = False) -> Observation:
        """Look all around, through the sensor."""
        return self._sensor.sense(self._inner.scan(thorough))

    def observe(self, focus: Sequence[Vec3] = ()) -> Observation:
        """Look towards points, through the sensor."""
        return self._sensor.sense(self._inner.observe(focus))


@dataclass(frozen=True, slots=True)
class SensorPart:
    """Implements `Eye`.

    Args:
        errors: what the sensor gets wrong.
        domain: whose movable things its detector may confuse with each other.
    """

    errors: Errors
    domain: Domain

    @property
    def identities(self) -> bool:
        """See the Protocol."""
        return self.errors.identities

    def around(self, environment: Environment) -> Environment:
        """See the Protocol; a sensor without errors changes nothing."""
        if self.errors == Errors(identities=self.errors.identities):
            return environment
        movable = self.domain.roles.movable
        labels = [c for c in self.domain.categories if self.domain.is_a(c, movable)]
        return SensedWorld(environment, Sensor(self.errors, labels))
