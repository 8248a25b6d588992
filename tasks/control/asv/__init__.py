"""Controllers of an autonomous surface vehicle."""
