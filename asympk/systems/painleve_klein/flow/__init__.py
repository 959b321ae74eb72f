"""The exact flow of one scene: closed form of a mode -> roots in their brackets -> segments -> Path.

The same code follows doubles and mpmath numbers, and its closed forms those of ``arrays`` as well; ``rounding``
estimates the error of a run in doubles.
"""
