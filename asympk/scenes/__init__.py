"""Scenes in files, in nondimensional or physical units, and those that ship (``asympk scenes``)."""
