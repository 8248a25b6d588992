"""Shoal's top-level packages: all that the wheel installs, and nothing else."""

PACKAGES = ("autonomy", "imc", "mavlink", "runtime", "shoal", "support", "tasks", "world")
TASKS = "tasks"  # of them the one that a user's own folder may extend
