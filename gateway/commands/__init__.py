"""One module per command of the command line. What is slow to import is imported where it is used."""
