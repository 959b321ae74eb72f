"""Models and integrators against the exact flow: their costs, their errors, and the least model that a scene needs."""
