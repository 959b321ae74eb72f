"""Blocks that rub, as the systems of scenes' files."""


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


def sliding_blocks(count):
    """Return the tables of blocks with the velocities v0, v1, ..., each slowed down by its own friction of 1."""
    rates = "".join(f'v{k} = "F{k}"\n' for k in range(count))
    frictions = "".join(f'[[system.frictions]]\nvelocity = "v{k}"\nforce = "F{k}"\nload = 1\nkinetic = 1\n'
                        for k in range(count))
    return f"[system.slow]\n{rates}{frictions}"
