"""Links to files, ground stations and other systems."""
