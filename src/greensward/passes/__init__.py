"""The rest of the picture: ground, solids, heads, shadows, sky, lighting, post."""
