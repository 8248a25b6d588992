"""Log tools: look at logs, edit them, export them, and select parts of them."""
