"""Controllers of a boat with a motor and a rudder."""
