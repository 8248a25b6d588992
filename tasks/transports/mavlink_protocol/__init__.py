"""MAVLink as a vehicle speaks it, without I/O: framing, conversion from IMC, commands and parameters."""
