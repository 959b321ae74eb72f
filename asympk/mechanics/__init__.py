r"""Mechanisms with one frictional contact: rigid motions and the paradox, the elastic contact, the jump through it.

    M(q) q'' = Q(q, q', t) + W_N R + W_T F,    g(q, t) >= 0 or = 0,    gamma = W_T . q' + gamma_t,

R is the reaction of the contact, and F its friction force with the load nu |R|. A user writes the classes of
``asympk.mechanics.mechanism``.
"""
