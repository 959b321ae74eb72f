"""The exact flow of many scenes: common courses by branch-free kernels, the rest by the safeguarded flow."""
