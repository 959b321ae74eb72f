"""Sweeps: more trajectories than fit into memory or into a day, chunk by chunk into a directory."""

from asympk.sweep.directory import MANIFEST, files, read_manifest, results, run_sweep

__all__ = ["MANIFEST", "files", "read_manifest", "results", "run_sweep"]
