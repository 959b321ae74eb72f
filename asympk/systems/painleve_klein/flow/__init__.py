"""The exact flow of one scene: closed form of a mode -> roots in their brackets -> segments -> Path.

The same code follows doubles and mpmath numbers; ``rounding`` estimates the error of a run in doubles.
"""
