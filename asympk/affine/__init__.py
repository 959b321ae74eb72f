r"""The exact flow of an affine mode ``w' = A w + b``: any dimension, closed form, events isolated by bounds.

    exact A, b -> characteristic polynomial, resolvent -> roots to any number of digits -> e^{M t} = sum F_r(t) D_r
               -> segment from a start -> first root of any guard

Everything up to the roots is exact: multiplicities are those of the polynomial over the rationals, so a defective block
(free motion, coalescence, resonance) is a polynomial times an exponential, and no difference of eigenvalues is ever
divided by in the numbers that a trajectory is computed in.
"""
