r"""Scenes in TOML: parameters as numbers or exact strings, nondimensional or physical, and those that ship.

    sigma = 1                      m = 1          # kg; or any consistent units
    mu = 1e-6                      P = 10         # N
    start = [0, 0.2, -1]           f = 3
    until = 5                      alpha = "60 deg"
                                   l = 1
                                   k = 1e6        # N
                                   h = 0.01       # s/m
                                   start = [0, 0, -1]   # R_1 in N, its rate in N/s, u in m/s
                                   until = 0.5          # s

A decimal in the file is the number it spells: 0.2 is 1/5. ``sigma0`` or ``f0`` adds static friction, ``about`` one line
on what the scene shows, and ``near = {manifold, x, offset, z}`` starts beside a slow line (``Scene.near``). A table
``[system]`` describes a system of one's own: see ``asympk.scenes.systemfile``.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from importlib.resources import files
from pathlib import Path
from typing import Any

from asympk.errors import InputError, UnknownName
from asympk.scene import Scene
from asympk.storage.tomlfile import nearest, parse_table, read_table, refuse_unknown, require_keys, spelled, word

COMMON = ("name", "about", "start", "until")
SYSTEM = ("system", "values")
NONDIMENSIONAL = ("sigma", "mu", "sigma0", "near")
PHYSICAL = ("m", "P", "f", "f0", "alpha", "l", "k", "h")
_NEAR = ("manifold", "x", "offset", "z")


@dataclass(frozen=True)
class SceneFile:
    """What a file says: the scene, and one line about it."""

    scene: Scene
    about: str = ""


def read_scene(where: str | Path) -> Scene:
    """Return the ``Scene`` in the TOML file ``where``, or the one of that name that ships with the package.

    Raises ``InputError`` for what is not a scene, ``UnknownName`` for a name that does not exist.

    >>> read_scene("backward").start
    (0, Fraction(1, 5), -1)
    """
    return scene_file(where).scene


def scene_file(where: str | Path) -> SceneFile:
    """Return the ``SceneFile`` of a file or of a scene that ships; raises as ``read_scene`` does."""
    if not isinstance(where, str | Path):
        raise InputError(f"read_scene takes the name of a scene or of a file, not {type(where).__name__}")
    if str(where) in scene_names():
        return _scene_of(parse_table(shipped(str(where)).encode(), where), str(where))
    if not (str(where).endswith(".toml") or Path(where).is_file()):
        near = nearest(str(where), scene_names())
        raise UnknownName(f"scene {str(where)!r:.60} is unknown; the nearest is {near!r}, asympk scenes lists all, and "
                          "a file must end in .toml")  # fmt: skip
    return _scene_of(read_table(where), str(where))


def changed(found: SceneFile, changes: Mapping[str, Any]) -> Scene:
    """Return the scene of a ``SceneFile`` with some nondimensional fields replaced; raises ``InputError``."""
    scene = found.scene
    if not changes:
        return scene
    if scene.rod or scene.near_to:
        tied = "its physical quantities" if scene.rod else "a slow line"
        raise InputError(f"--{next(iter(changes))}: scene {scene.name!r} is tied to {tied}; change a copy of its file")
    static = {"sigma0": None} if scene.sigma0 == scene.sigma else {}
    return replace(scene, **{**static, **changes})


def scene_names() -> tuple[str, ...]:
    """Return the names of the scenes that ship."""
    found = (file.name for file in files("asympk").joinpath("scenes").iterdir())
    return tuple(sorted(name.removesuffix(".toml") for name in found if name.endswith(".toml")))


def shipped(name: str) -> str:
    """Return the text of the scene that ships as ``name``."""
    return files("asympk").joinpath("scenes", f"{name}.toml").read_text(encoding="utf-8")


def about(name: str) -> str:
    """Return the line on what the scene that ships as ``name`` shows."""
    return word(parse_table(shipped(name).encode(), name), "about", name)


def _scene_of(table, where):
    if "coordinates" in table:
        raise InputError(f"{where}: it is a mechanism, told by asympk mechanism; a scene has it as [system.mechanism]")
    refuse_unknown(table, (*COMMON, *NONDIMENSIONAL, *PHYSICAL, *SYSTEM), where)
    entries = {key: value for key, value in table.items() if key != "about"}
    entries["name"] = word(table, "name", where, Path(where).stem)
    line = word(table, "about", where)
    try:
        made = {SYSTEM: _of_system, PHYSICAL: _from_rod, NONDIMENSIONAL: _nondimensional}[keys_of(table)]
        return SceneFile(made(entries), line)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None


def keys_of(table: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the keys of the kind that a table is of, ``SYSTEM``, ``PHYSICAL`` or ``NONDIMENSIONAL``.

    Raises ``InputError`` for a table of two kinds.
    """
    physical, other = ([key for key in table if key in keys] for keys in (PHYSICAL, NONDIMENSIONAL))
    of_system = any(key in table for key in SYSTEM)
    if (physical or other) and of_system:
        raise InputError(f"{(physical + other)[0]} is the rod's; parameters of a system stand in [values]")
    if physical and other:
        raise InputError(f"{physical[0]} is physical and {other[0]} is not; give one kind of parameters only")
    return SYSTEM if of_system else PHYSICAL if physical else NONDIMENSIONAL


def _of_system(entries):
    from asympk.scenes.systemfile import read_system_scene

    require_keys(entries, ("system",))
    return read_system_scene(entries)


def _nondimensional(entries):
    beside = entries.pop("near", None)
    if beside is None:
        require_keys(entries, ("sigma", "mu", "start", "until"))
        return Scene(**{**{key: spelled(value) for key, value in entries.items()}, "start": _list(entries["start"])})
    if "start" in entries or not isinstance(beside, dict):
        raise InputError("near must be a table {manifold, x, offset, z}, and stands in place of start")
    require_keys(entries, ("sigma", "mu", "until"))
    refuse_unknown(beside, _NEAR, "near")
    require_keys(beside, _NEAR)
    return Scene.near(**{key: spelled(value) for key, value in {**beside, **entries}.items()})


def _from_rod(entries):
    require_keys(entries, (*(key for key in PHYSICAL if key != "f0"), "start", "until"))
    given = {key: spelled(entries[key]) for key in (*PHYSICAL, "until", "name") if key in entries}
    return Scene.physical(**given, start=_list(entries["start"]))


def _list(value):
    return [spelled(item) for item in value] if isinstance(value, list) else spelled(value)
