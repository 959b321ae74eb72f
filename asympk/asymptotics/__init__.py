"""Small mu: series in mu and log(1/mu) -> itinerary and layers -> the jump map -> models in numbers.

``tape`` records a derivation once; ``compiledlayers`` runs that of a layer on floats, mpmath numbers and arrays.
"""
