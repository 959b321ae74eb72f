"""Symbols: System -> critical and slow manifolds, stability, regions of the switching plane, regimes -> callables.

``lowering`` is the only door from symbols to numbers.
"""
