"""The vehicle's side of MAVLink: links to ground stations, sessions, commands and parameters."""
