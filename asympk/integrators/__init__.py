"""One small module per family of integrators; ``asympk.integrators.integrate`` and ``asympk.methods`` name them."""
