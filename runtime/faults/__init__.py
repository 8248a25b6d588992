"""Faults of tasks in simulation: what they publish is lost, stuck, shifted or noisy, or they fail."""
