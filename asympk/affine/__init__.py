r"""The exact flow of affine modes ``w' = A w + b``: in closed form, with events isolated by bounds.

    exact A, b -> eigenpairs refined in whole numbers, or, where eigenvalues are multiple,
                  resolvent -> roots to any number of digits
               -> e^{M t} = sum F_r(t) D_r -> segment from a start -> first root of any guard

Multiplicities are those of the exact matrix. A defective block (free motion, coalescence, resonance) is therefore a
polynomial times an exponential. Eigenvalues near one another have divided differences of exponentials in its place, so
that the numbers of a trajectory are never divided by a difference of eigenvalues.
"""
