"""Control laws and the allocation of actuators."""
