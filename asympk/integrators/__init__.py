"""One small module per family of integrators; ``asympk.integrate`` and ``asympk.methods`` name them."""
