"""The links of a vehicle to MAVLink ground stations: sockets, serial lines, keys, files, and logged vehicles."""
