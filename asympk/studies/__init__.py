"""Models against the exact flow: what they cost, what they get wrong, and which is the least that a scene needs."""
