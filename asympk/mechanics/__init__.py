r"""Mechanisms with one frictional contact: rigid motions and the paradox, the elastic contact, the jump through it.

    M(q) q'' = Q(q, q', t) + W_N R + W_T F,    g(q, t) >= 0 or = 0,    gamma = W_T . q' + gamma_t,

R is the contact's reaction, F its friction force with the load nu |R|; see ``mechanism`` for what a user writes.
"""
