"""Supervisors of underwater vehicles."""
