"""How the tests are shared among workers: a file to a worker, which computes once what its tests share."""

import gc
import os
import sys
from collections import defaultdict
from pathlib import Path
from random import Random

import pytest
from hypothesis import HealthCheck, settings

settings.register_profile("calm", derandomize=True, deadline=None, database=None, suppress_health_check=[*HealthCheck])
settings.load_profile("calm")  # the same examples in every run, however busy the machine is
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # a worker to a core; more threads than cores wait for one another
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)  # tests start many processes, and each would compile the package anew
sys.dont_write_bytecode = False

MOST = 2  # the number of cases of a test marked ``few`` beyond which cases are left to a command of their own

# these come first, so that no worker ends alone on one of them
LONGEST = ("test_paper", "test_regeneration", "test_smooth_models", "test_manifold", "test_affine_scenes",
           "test_friction_models", "test_asymptotic", "test_cli", "test_shown", "test_global_state")


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Put the longest files first; the others stay in order. Mark as slow what is further, or what ``few`` leaves out.

    Cases beyond ``MOST`` are further ones.
    """
    place = {name: k for k, name in enumerate(LONGEST)}
    items.sort(key=lambda item: place.get(Path(item.path).stem, len(LONGEST)))
    cases = defaultdict(list)
    for item in items:
        if item.get_closest_marker("further"):
            item.add_marker("slow")
        if (few := item.get_closest_marker("few")) and not item.get_closest_marker("slow"):
            cases[item.nodeid.partition("[")[0], *few.args].append(item)
    for (_, count), found in cases.items():
        drawn = Random(0).sample(found, len(found))
        for item in drawn[count:]:
            item.add_marker("slow")
        for item in drawn[max(count, MOST) :]:
            item.add_marker("further")


def pytest_collection_finish() -> None:
    """Look for garbage less often, and not in what is imported: expressions are many and hardly ever in circles."""
    gc.freeze()
    gc.set_threshold(20_000, 20, 20)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: object) -> object:
    """Give whole files to workers, in the order of the collection."""
    from xdist.scheduler import LoadFileScheduling

    config.option.loadscopereorder = False
    return LoadFileScheduling(config, log)
