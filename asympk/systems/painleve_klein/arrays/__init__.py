"""The exact flow of many scenes: common courses by branch-free kernels, the rest by the safeguarded flow."""

# what became of a trajectory: the words that ``outcome`` is an index of
OUTCOMES = ("followed", "too many events", "beyond the range of doubles", "undecided")
