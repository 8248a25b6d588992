"""Navigation of an unmanned aerial vehicle."""
