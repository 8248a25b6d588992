"""The tasks that come with Shoal: one file each, the path is the name."""
