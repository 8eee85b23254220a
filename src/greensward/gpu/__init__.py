"""How we talk to OpenGL: context, programs, uniform blocks, timers, read-back. Knows no grass."""
