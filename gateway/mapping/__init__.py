"""Mapping files: profiles of drive models and site files, read into frozen models. Pure but for `reader`."""
