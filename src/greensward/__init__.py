"""Living grass for Python and OpenGL: millions of blades, each swaying on its own."""

__version__ = "0.1.0"
