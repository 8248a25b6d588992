"""The simulated world: vehicle dynamics, sea, sensors and pictures."""
