"""Following references from outside, by kind of vehicle."""
