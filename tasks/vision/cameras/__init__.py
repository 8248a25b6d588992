"""What the camera tasks share: frames, calibration, pictures on disk and in the log."""
