"""Sweeps: more trajectories than memory can hold or one run can follow, computed chunk by chunk into a directory."""

from asympk.sweep.directory import MANIFEST, files, read_manifest, results, run_sweep

__all__ = ["MANIFEST", "files", "read_manifest", "results", "run_sweep"]
