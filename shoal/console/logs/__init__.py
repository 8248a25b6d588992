"""Logs on the page: listed, played, resumed."""
