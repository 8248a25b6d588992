"""The kernel, bus and vehicle that tasks run on."""
