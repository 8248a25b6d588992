"""Common parts of the camera tasks: frames, calibration, pictures on disk and in the log."""
