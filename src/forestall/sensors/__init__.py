"""What a real camera and a real detector make of a drawn picture: noise, holes, wrong masks."""

from forestall.sensors.depth import DEPTH_CAMERAS
from forestall.sensors.sensor import REALISTIC, Errors, Sensor
from forestall.sensors.world import SensedWorld, SensorPart

__all__ = ["DEPTH_CAMERAS", "REALISTIC", "Errors", "SensedWorld", "Sensor", "SensorPart"]
