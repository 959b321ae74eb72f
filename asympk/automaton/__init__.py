"""The automaton of a system in numbers: its modes with their guards, which mode follows, and the loop over them."""
