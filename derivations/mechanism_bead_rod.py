"""A rod with a bead on a rough wire: two motions or none, where the rod on the ground may also lift off."""

# %% The same contact, holding both ways
from asympk.systems import bead_rod, painleve_rod

mechanism, ground = bead_rod.mechanism(), painleve_rod.mechanism()

# %% Counts of rigid motions at the example, on the wire and on the ground, in both directions
state = {**bead_rod.VALUES, **bead_rod.STATE}
numbers = {name: value for name, value in state.items() if name not in ("c", "h")}
counts = {}
for name, rod in (("wire", mechanism), ("ground", ground)):
    for way in (-1, 1):
        there = {**numbers, "X'": way * 2}
        counts[f"{name} {'forward' if way > 0 else 'backward'}"] = len(rod.motions(there))

RESULTS = {"delassus": mechanism.plain.delassus, "rigid_motions": counts}
