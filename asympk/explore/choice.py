"""The scenes that an argument of the command line names: one that ships, a file, or a system of the catalogue."""

from asympk import systems
from asympk.errors import InputError
from asympk.scene import Scene
from asympk.scenes.scenefile import is_file, known_name, read_scene, scene_names
from asympk.storage.tomlfile import read_table
from asympk.systems.catalogue import example_scene, example_scenes

FIRST = "backward"
COMPLIANCE, DAMPING, UNTIL = "1e-4", "1/2", 1  # for a mechanism's file without these


def require_known(word: str | None) -> None:
    """Raise ``UnknownName`` for a word that names no scene, ``InputError`` for a file that cannot be read."""
    if word is not None:
        read_table(word) if is_file(word) else known_name(word)


def chosen_scenes(word: str | None) -> tuple[Scene, ...]:
    """Return the scenes that ``word`` names; for None, all that ship. Raises ``UnknownName``, ``InputError``."""
    if word is None:
        return tuple(read_scene(name) for name in (FIRST, *(name for name in scene_names() if name != FIRST)))
    if is_file(word):
        keys = read_table(word).keys()
        return _of_mechanism(word) if "coordinates" in keys and "until" not in keys else (read_scene(word),)
    name = known_name(word)
    return example_scenes(name) if name in systems.__all__ else (read_scene(name),)


def _of_mechanism(file: str) -> tuple[Scene, ...]:
    """Return the example in a mechanism's file with an elastic and with a rigid contact, where its start fits each."""
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
        except InputError as error:  # where the damper pushes before touch-down, the start fits the rigid one alone
            refused.append(error)
    if not scenes:
        raise refused[-1]
    return tuple(scenes)
