"""The exact flow of many scenes: common itineraries by branch-free kernels, the rest by the safeguarded flow."""
