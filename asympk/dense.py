class Dense:
    def __init__(self, segments):
        self.segments = segments

    def __call__(self, t):
        for start, piece in reversed(self.segments):
            if t >= start:
                x, y, _, z = piece.state(t - start)
                return x, y, z
