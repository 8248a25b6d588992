"""Log tools: look at logs, edit them, export them, and select what is wanted."""
