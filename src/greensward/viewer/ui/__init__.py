"""User interface of the viewer, drawn with Dear ImGui."""
