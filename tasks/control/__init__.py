"""Controllers: from references to actuators."""
