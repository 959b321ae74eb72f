"""The scenes that an argument of the command line names: one that ships, a file, or a system of the catalogue."""

from collections.abc import Callable
from functools import partial

from asympk import systems
from asympk.errors import InputError
from asympk.mechanics.described import Described, describes_mechanism, mechanism_of_table
from asympk.scene import Scene
from asympk.scenes.scenefile import is_file, known_name, read_scene, scene_names, scene_of_table
from asympk.storage.tomlfile import read_table
from asympk.systems.catalogue import example_scene, example_scenes

COMPLIANCE, DAMPING, UNTIL = "1e-4", "1/2", 1  # for a mechanism's file without these


def chosen_scenes(word: str | None) -> Callable[[], tuple[Scene, ...]]:
    """Return the function that derives the scenes that ``word`` names; for None, all that ship.

    A file, which may be a pipe, is read once, before the function is returned. Raises ``UnknownName`` for a word that
    names no scene, ``InputError`` for a file of no scene and of no mechanism; the function raises ``InputError`` for a
    mechanism that cannot be followed.
    """
    if word is None:
        return lambda: tuple(map(read_scene, scene_names()))
    if is_file(word):
        table = read_table(word)
        if describes_mechanism(table) and "until" not in table:
            return partial(_of_mechanism, mechanism_of_table(table, word))
        scene = scene_of_table(table, word)
        return lambda: (scene,)
    name = known_name(word)
    return partial(example_scenes, name) if name in systems.__all__ else lambda: (read_scene(name),)


def _of_mechanism(found: Described) -> tuple[Scene, ...]:
    """Return the example of a described mechanism with an elastic and a rigid contact, where its start fits each."""
    mechanism, state = found.mechanism, found.state
    c, h = (mechanism.plain.unused_symbol(name, *mechanism.parameters, positive=True) for name in "ch")
    values = {str(c): COMPLIANCE, str(h): DAMPING, **found.values}
    models = {"elastic contact": mechanism.elastic(compliance=c, damping=h), "rigid": mechanism.rigid()}
    scenes, refused = [], []
    for name, model in models.items():
        try:
            scenes.append(example_scene(mechanism, model, values, state, UNTIL, name))
        except InputError as error:  # where the damper pushes before touch-down, the start fits the rigid one alone
            refused.append(error)
    if not scenes:
        raise refused[-1]
    return tuple(scenes)
