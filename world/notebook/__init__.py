"""Sensors of a quadrotor for notebooks, with the names, calls and readings of quadsim's notebook on sensors."""

from world.notebook.camera import Camera
from world.notebook.gps import GPS, GpsReading
from world.notebook.inertial import Accelerometer, RateGyro
from world.notebook.quadrotor import Quadrotor, Rot_v_to_b, rot3d
from world.notebook.sensor import Sensor, SensorManager

__all__ = [
    "GPS",
    "Accelerometer",
    "Camera",
    "GpsReading",
    "Quadrotor",
    "RateGyro",
    "Rot_v_to_b",
    "Sensor",
    "SensorManager",
    "rot3d",
]
