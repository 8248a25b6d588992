"""Basics for every layer, of geometry, files, words and errors, without messages; each module is imported as it is."""
