"""Navigation: estimates of position and motion, and their uncertainty."""
