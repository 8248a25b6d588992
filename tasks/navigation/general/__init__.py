"""Navigation of vehicles that have GPS all the time."""
