"""Which scenes a word on the command line names: one that ships, a file, or a member of the catalogue."""

from importlib import import_module

from asympk import systems
from asympk.errors import InputError, UnknownName
from asympk.scene import Scene
from asympk.scenes.scenefile import read_scene, scene_names
from asympk.storage.tomlfile import nearest, read_table
from asympk.systems.catalogue import example_scene
from asympk.systems.kernels import kernel_scene

FIRST = "backward"
COMPLIANCE, DAMPING, UNTIL = "1e-4", "1/2", 1  # of a mechanism whose file tells of none


def require_known(word: str | None) -> None:
    """Raise ``UnknownName`` for a word that names no scene, ``InputError`` for a file that cannot be read."""
    if word is None or word in systems.__all__ or word in scene_names():
        return
    if not word.endswith(".toml"):
        known = (*scene_names(), *systems.__all__)
        raise UnknownName(f"scene {word!r:.60} is unknown; the nearest is {nearest(word, known)!r}; give a scene that "
                          "ships, a system of the catalogue, or a .toml file")  # fmt: skip
    read_table(word)


def chosen_scenes(word: str | None) -> tuple[Scene, ...]:
    """Return the scenes that ``word`` names; without one all that ship. Raises ``UnknownName``, ``InputError``."""
    require_known(word)
    if word is None:
        return tuple(read_scene(name) for name in (FIRST, *(name for name in scene_names() if name != FIRST)))
    if word in systems.__all__ and word not in scene_names():
        return _of_catalogue(word)
    if word.endswith(".toml") and "coordinates" in read_table(word):
        return _of_mechanism(word)
    return (read_scene(word),)


def _of_catalogue(name: str) -> tuple[Scene, ...]:
    module = import_module(f"asympk.systems.{name}")
    if not hasattr(module, "scenes"):
        raise UnknownName(f"system {name!r} has no scenes; write one in a .toml file with system = {name!r}")
    return tuple(kernel_scene(scene) or scene for scene in module.scenes())


def _of_mechanism(file: str) -> tuple[Scene, ...]:
    """Return a mechanism's example with an elastic contact, and with a rigid one, as far as they have its start."""
    from asympk.mechanics.described import read_mechanism

    found = read_mechanism(file)
    c, h = (found.mechanism.plain.spare(name, positive=True) for name in "ch")
    values = {str(c): COMPLIANCE, str(h): DAMPING, **found.values}
    models = {"elastic contact": found.mechanism.elastic(compliance=c, damping=h), "rigid": found.mechanism.rigid()}
    mechanism, state = found.mechanism, found.state
    scenes, refused = [], []
    for name, model in models.items():
        try:
            scenes.append(example_scene(mechanism, model, values, state, UNTIL, name))
        except InputError as error:  # a body above a contact whose damper pushes already has a rigid one alone
            refused.append(error)
    if not scenes:
        raise refused[-1]
    return tuple(scenes)
