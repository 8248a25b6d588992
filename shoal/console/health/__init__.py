"""Advice, checks before a dive, and rates of messages."""
