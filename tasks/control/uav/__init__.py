"""Controllers of a multirotor."""
