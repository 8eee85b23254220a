"""The window. Everything but `window.py` and `face/` works without one, and without its toolkit."""
