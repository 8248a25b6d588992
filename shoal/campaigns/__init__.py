"""Campaigns: many runs of scenarios, what varies in them, and what they show."""
