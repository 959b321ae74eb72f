"""A block on a spring that rubs, as the system of a scene's file."""


def spring_block(kinetic, velocity="v"):
    """Return the tables of the system and of its friction, to which a static bound may be added."""
    return f"""[system.slow]
x = "v"
v = "-x + F"

[[system.frictions]]
velocity = "{velocity}"
force = "F"
load = 1
kinetic = "{kinetic}"
"""
