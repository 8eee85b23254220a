"""Viewer: a window on a scene, and a widget in a notebook. Only `window.py` and `ui/` need the window toolkit."""
