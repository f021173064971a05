"""The demo: a site of its own, run by a supervisor, with its values on the terminal."""
