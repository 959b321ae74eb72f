"""Scenes in files, in nondimensional or physical units, and the scenes that ship (``asympk scenes``)."""
