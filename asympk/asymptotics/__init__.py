"""Small mu: the jump map in symbols, and the asymptotic models in numbers.

In symbols: ``series`` in mu and log(1/mu), ``itinerary``, ``layers``, ``jump`` and ``base``. In numbers, for the rod:
``compiledlayers``, ``composite``, ``models``. In numbers, for any system: ``fibre``, ``landing``, ``reduced``,
``smooth``, ``matched``, ``impact``, ``frictional``, ``general``.
"""
