"""Shoal's simulators know the options that DUNE's AUV profiles set."""

import pytest

from runtime.task import find_parameter
from runtime.vehicle import all_tasks

OPTIONS = {
    "DVL": {
        "Invalid Reading Probability": "10",
        "Standard Deviation - Ground Velocity": "0.002",
        "Standard Deviation - Water Velocity": "0.002",
    },
    "DepthSensor": {"Standard Deviation": "0.05"},
    "Environment": {
        "Bottom Beam Width": "-1.0",
        "Bottom Distance Standard Deviation": "0.05",
        "Bottom Intersection Method": "true",
        "Bottom Sonar Orientation": "0, -90, 0",
        "Bottom Sonar Position": "0, 0, 0",
        "Entity Label - Bottom Distance": "Altimeter",
        "Entity Label - Forward Distance": "Echo Sounder",
        "Forward Beam Width": "10.0",
        "Forward Distance Standard Deviation": "0.3",
        "Forward Range": "30.0",
        "Forward Sonar Orientation": "0, 0, 0",
        "Forward Sonar Position": "1, 0, 0",
        "Location": "APDL",
        "Out Of Bounds Depth": "120.0",
        "Pier Points": "0.718833261, -0.151945171, 0.718807517, -0.151920666",
        "Simulate Pier": "false",
        "Tide Level": "0.0",
    },
    "GPS": {
        "Activation Depth": "0.2",
        "HACC": "2",
        "HDOP": "0.9",
        "Initial Position": "41.185, -8.7062",
        "Number of Satellites": "8",
        "Report Ground Velocity": "false",
        "Report Yaw": "false",
    },
    "Gaussian": {
        "Invalid at Surface": "true",
        "Name of message to produce": "SoundSpeed",
        "Value at peak": "1522",
        "Value away from peak": "1500",
    },
    "IMU": {
        "Gyro Rate Bias": "0",
        "Standard Deviation - Angular Velocity": "0.05",
        "Standard Deviation - Euler Angles": "0.05",
        "Standard Deviation - Heading Offset": "0",
    },
    "Leaks": {"Leak Entities": "Leak Sensor - Tail, Leak Sensor - Nose"},
    "Motor": {"Thruster Act to RPM Factor": "9.55, 2450.4", "Thruster Id": "0"},
    "Servos": {
        "Enable Rotation Rate": "true",
        "Fault Time": "10.0",
        "Generate Faults": "false",
        "Maximum Angle": "45.0",
        "Maximum Rate": "333.3",
    },
    "StreamVelocity": {
        "Default Speed Down": "0.0",
        "Default Speed East": "0.0",
        "Default Speed North": "0.0",
        "Stream Velocity Source": "Constant",
    },
    "VSIM": {"Entity Label - Stream Velocity Source": "Stream Velocity Simulator", "Time Multiplier": "1.0"},
}


@pytest.mark.parametrize("task", OPTIONS)
def test_options_of_dune(task):
    parameters = all_tasks()[f"Simulators.{task}"].parameters()
    for option, text in OPTIONS[task].items():
        parameter = find_parameter(parameters, option)
        assert parameter is not None, option
        parameter.parse(text)
