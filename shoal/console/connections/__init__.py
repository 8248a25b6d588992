"""Connections of browsers, their number and their time limits."""
