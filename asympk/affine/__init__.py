r"""The exact flow of an affine mode ``w' = A w + b``: any dimension, closed form, events isolated by bounds.

    exact A, b -> eigenpairs refined in whole numbers, or, where eigenvalues are multiple,
                  characteristic polynomial, resolvent -> roots to any number of digits
               -> e^{M t} = sum F_r(t) D_r -> segment from a start -> first root of any guard

Multiplicities are those of the exact matrix, so a defective block (free motion, coalescence, resonance) is a polynomial
times an exponential, and no difference of eigenvalues is ever divided by in the numbers that a trajectory is computed
in.
"""
