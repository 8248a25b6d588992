"""Tasks that connect a vehicle to files, ground stations and other systems."""
