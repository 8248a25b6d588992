"""Steering by hand."""
