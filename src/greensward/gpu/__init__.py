"""OpenGL: device, layouts, programs, kernels and draws by name, timers. Knows no grass."""
