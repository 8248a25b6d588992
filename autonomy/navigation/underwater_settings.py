"""The settings of an underwater vehicle's navigation: sensors, their limits and their noise."""

import math
from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class UnderwaterSettings:
    """Settings in SI units; `dvl` is the name of the velocity log. The defaults are those of a small vehicle."""

    dvl: str = "DVL"
    dvl_jumps: Sequence[float] = (1.5, 0.6)  # m/s, largest change of surge and sway within the window
    dvl_jump_window: float = 0.5  # s
    dvl_largest: Sequence[float] = (5.0, 1.5)  # m/s, largest surge and sway
    dvl_timeout: float = 3.0  # s after which velocities count as missing
    dvl_silence: float = 60.0  # s without any message of the log before a fault, 0 for never
    dvl_misalignment: float = math.radians(0.5)  # rad, largest one between velocity log and attitude reference
    dvl_arm: float = 0.0  # m ahead of the center of gravity
    speed_per_rpm: float = 1.015e-3  # m/s/rpm
    speed_variation: float = 6e-4  # m/s/rpm, largest deviation of it
    speed_drift: float = 1e-12  # (m/s/rpm)², variance added per 0.05 s
    altitude_gain: float = 0.2  # weight of a new distance
    altitude_compensation: bool = True  # for roll and pitch
    altitude_timeout: float = 5.0  # s
    euler_timeout: float = 10.0  # s
    depth_timeout: float = 5.0  # s
    depth_variance: float = 0.0025  # m²
    initial_depth: float = 0.0  # m, until one is measured
    gps_arm: float = 0.0  # m, height of the antenna above the center of gravity
    gps_factor: float = 1.8  # an accuracy above the mean by this factor is rejected
    gps_samples: int = 7  # fixes in that mean
    gps_deepest: float = 1.0  # m, below which the antenna has no reception
    gps_hacc: float = 20.0  # m
    gps_hdop: float = 4.0
    gps_variances: Sequence[float] = ()  # m², by class of accuracy; empty: those that the fixes claim
    measurement: Sequence[float] = (1e-3, 1e-4, 1e-3, 1e-3)  # variances of surge, sway, heading and its rate
    process: Sequence[float] = (1e-3, 1e-3, 1e-1, 1e-2, 1e-7, 5e-11)  # position, heading, rate, speeds, two biases
    initial: Sequence[float] = (1000.0, 1.0, 1.0, 1e-4, 1.6e-8)  # position, angles, speeds, biases, speed per rpm
    farthest: float = 1000.0  # m, at which the reference is moved
    execution_frequency: float = 20.0  # Hz
