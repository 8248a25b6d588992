"""The tasks of Shoal: one file each, named by its path."""
