"""The corners of a cube of one metre, as an OBJ file has them: four below, four above, both counter-clockwise."""

CORNERS = """v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
v 0 0 1
v 1 0 1
v 1 1 1
v 0 1 1
"""
