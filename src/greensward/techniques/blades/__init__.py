"""Parts that techniques of blades share: their settings as leaves, their outlines and their material."""
