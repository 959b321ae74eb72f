"""The exact flow of one scene: closed form of a mode -> roots in their brackets -> segments -> Path.

One text over doubles and mpmath numbers; ``rounding`` is the account that a run in doubles gives of itself.
"""
