"""The cases of `scripts/fuzz.py`, a module for each kind."""
