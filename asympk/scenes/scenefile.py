r"""Scenes in TOML: parameters as numbers or exact strings, nondimensional or physical, and the scenes that ship.

    sigma = 1                      m = 1          # kg; or any consistent units
    mu = 1e-6                      P = 10         # N
    start = [0, 0.2, -1]           f = 3
    until = 5                      alpha = "60 deg"
                                   l = 1
                                   k = 1e6        # N
                                   h = 0.01       # s/m
                                   start = [0, 0, -1]   # R_1 in N, its rate in N/s, u in m/s
                                   until = 0.5          # s

Decimals are read exactly: 0.2 is 1/5. A number may be a formula of numbers, "sqrt(2)/2" or "pi/4". ``sigma0`` or
``f0`` adds static friction, ``units = ["t", "N", "mm", "s"]`` names the units of mass, force, length and time where
they are not those of SI, and ``about`` is one line on what the scene shows. ``near = {manifold, x, offset, z}``, in
place of ``start``, starts beside a slow line (``Scene.near``). A table ``[system]`` describes a system of one's own:
see ``asympk.scenes.systemfile``. A mechanism's file with ``until`` is a scene, too: see ``asympk.mechanics.described``.
``read_scene`` reads a file, ``keys_of`` tells its kind.
"""

import json
import os
from collections.abc import Mapping
from fractions import Fraction
from importlib import import_module
from importlib.resources import files
from pathlib import Path
from types import MappingProxyType
from typing import Any

from asympk import systems
from asympk.errors import InputError, UnknownName
from asympk.formulas import read_constant, read_constants
from asympk.mechanics.described import NUMBERS, describes_mechanism, refuse_sweep, scene_table
from asympk.naming import named
from asympk.scene import Scene
from asympk.scenes.systemfile import MECHANISM, read_system_scene
from asympk.storage.tomlfile import parse_table, read_table, refuse_unknown, require_keys, word
from asympk.systems.catalogue import about_system, example_scenes

COMMON = ("name", "about", "start", "until")
SYSTEM = ("system", "values")
NONDIMENSIONAL = ("sigma", "mu", "sigma0", "near")
PHYSICAL = ("m", "P", "f", "f0", "alpha", "l", "k", "h")
UNITS = "units"  # of physical quantities: the names of those of mass, force, length and time
_SINGLE = ("sigma", "mu", "sigma0", *PHYSICAL, "until")  # the numbers of a rod, without those of its start
_NEAR = ("manifold", "x", "offset", "z")


def read_scene(where: str | Path) -> Scene:
    """Return the ``Scene`` in the TOML file ``where``, one that ships, or the example of a system of the catalogue.

    Raises ``InputError`` for what is not a scene, ``UnknownName`` for a name that does not exist.

    >>> read_scene("backward").start
    (0, Fraction(1, 5), -1)
    """
    if not isinstance(where, str | Path):
        raise InputError(f"read_scene takes the name of a scene or of a file, not {type(where).__name__}")
    if is_file(where):
        return scene_of_table(read_table(where), str(where))
    name = known_name(str(where))
    if name in scene_names():
        return scene_of_table(parse_table(shipped(name).encode(), name), name)
    return example_scenes(name)[0]


def changed_scene(where: str, changes: dict[str, Any]) -> tuple[Scene, dict[str, Any]]:
    """Return the scene ``where`` after ``changes`` of numbers in tables of its file, and the changes of other numbers.

    The numbers of an example of the catalogue are those of its mechanism. A start in coordinates and rates is derived
    anew. Raises as ``read_scene`` does.
    """
    scene = None if is_file(where) else read_scene(where)
    if scene is not None and (scene.origin is None or not changes):
        return scene, changes
    if scene is None:
        table = read_table(where)
    else:  # the file of an example of the catalogue has no name of its own
        table = {"name": scene.name, **parse_table(scene_text(known_name(where)).encode(), where)}
    own = {name for key in NUMBERS & table.keys() if isinstance(table[key], dict) for name in table[key]}
    taken = {name: read_constant(name, value) for name, value in changes.items() if name in own}
    left = {name: value for name, value in changes.items() if name not in own}
    return scene_of_table(table, where, taken), left


def is_file(where: str | Path) -> bool:
    """Tell whether ``where`` names a file, a pipe or a directory, which is refused as such, and no scene that ships."""
    name = str(where)
    there = os.path.exists(name) and not (Path(where).is_dir() and name in systems.__all__)
    return name not in scene_names() and (name.endswith(".toml") or there)


def is_scene(where: str) -> bool:
    """Tell whether ``where`` names a file, a scene that ships, or a system of the catalogue."""
    return is_file(where) or where in (*scene_names(), *systems.__all__)


def known_name(word: str, beyond: str = ", or a file that ends in .toml") -> str:
    """Return the scene that ships, or the system of the catalogue, that ``word`` spells; raises ``UnknownName``."""
    return named("scene", word, (*scene_names(), *systems.__all__), beyond)


def scene_names() -> tuple[str, ...]:
    """Return the names of the scenes that ship."""
    found = (file.name for file in files("asympk").joinpath("scenes").iterdir())
    return tuple(sorted(name.removesuffix(".toml") for name in found if name.endswith(".toml")))


def shipped(name: str) -> str:
    """Return the text of the scene that ships as ``name``."""
    return files("asympk").joinpath("scenes", f"{name}.toml").read_text(encoding="utf-8")


def about(name: str) -> str:
    """Return the line that describes ``name``, a scene that ships or a system of the catalogue."""
    if name in systems.__all__:
        return about_system(name)
    return word(parse_table(shipped(name).encode(), name), "about")


def scene_text(name: str) -> str:
    """Return the TOML text of a scene that ships, or of the first example of a system of the catalogue."""
    if name not in systems.__all__:
        return shipped(name).rstrip()
    scene = import_module(f"asympk.systems.{name}").scenes()[0]
    line, system = json.dumps(about(name), ensure_ascii=False), [f'system = "{name}"']
    values = dict(zip(map(str, scene.system.parameters), scene.values, strict=True))
    start = dict(zip(scene.names, scene.start, strict=True))
    if scene.origin is not None:
        (values, start), law = scene.origin[1:3], ("eps^2", "0") if "eps" in values else ("c", "h")
        system = [f'system.{key} = "{word}"' for key, word in zip(MECHANISM, (name, "elastic", *law), strict=True)]
    lines = [f"about = {line}", *system, f"until = {_number(scene.until)}"]
    for table, entries in (("values", values), ("start", start)):
        lines += ["", f"[{table}]", *(f"{_key(entry)} = {_number(number)}" for entry, number in entries.items())]
    return "\n".join(lines)


def _key(name):
    return name if name.isidentifier() else f'"{name}"'


def _number(value):
    """Spell an exact number, also in a string, or a double: as a decimal where that is the number, else as a ratio."""
    value = Fraction(value) if isinstance(value, str) else value
    if isinstance(value, float) or value == int(value):
        return repr(value if isinstance(value, float) else int(value))
    decimal = repr(float(value))
    return decimal if Fraction(decimal) == value else f'"{value}"'


def scene_of_table(table: dict[str, Any], where: str, changes: Mapping[str, Any] = MappingProxyType({})) -> Scene:
    """Return the ``Scene`` in a table, also of a mechanism, after ``changes`` of numbers; raises ``InputError``."""
    refuse_sweep(table, where, _SINGLE)
    if describes_mechanism(table):
        table = scene_table(table, where)
    refuse_unknown(table, (*COMMON, *NONDIMENSIONAL, *PHYSICAL, UNITS, *SYSTEM), where)
    entries = {key: value for key, value in table.items() if key != "about"}
    try:
        word(table, "about")
        entries["name"] = word(table, "name", Path(where).stem)
        if (keys := keys_of(table)) is SYSTEM:
            return read_system_scene(entries, changes)
        return (_from_rod if keys is PHYSICAL else _nondimensional)(_with_constants(entries))
    except (InputError, UnknownName) as error:
        raise type(error)(f"{where}: {error}") from None


def _with_constants(entries: dict[str, Any]) -> dict[str, Any]:
    """Return the entries of a rod with numbers for formulas of numbers; an angle in degrees stays as it is."""
    read = {key: read_constant(key, entries[key], angles=False) for key in entries if key in _SINGLE}
    listed = {"start": read_constants("start", entries["start"], angles=False)} if "start" in entries else {}
    return entries | read | listed


def keys_of(table: Mapping[str, Any]) -> tuple[str, ...]:
    """Return ``SYSTEM``, ``PHYSICAL`` or ``NONDIMENSIONAL`` by the keys in a table; raises ``InputError`` for two."""
    physical, other = ([key for key in table if key in keys] for keys in ((*PHYSICAL, UNITS), NONDIMENSIONAL))
    of_system = any(key in table for key in SYSTEM)
    if (physical or other) and of_system:
        raise InputError(f"{(physical + other)[0]} is the rod's; parameters of a system stand in [values]")
    if physical and other:
        raise InputError(f"{physical[0]} is physical and {other[0]} is not; give one kind of parameters only")
    return SYSTEM if of_system else PHYSICAL if physical else NONDIMENSIONAL


def _nondimensional(entries):
    beside = entries.pop("near", None)
    if beside is None:
        require_keys(entries, ("sigma", "mu", "start", "until"))
        return Scene(**entries)
    if "start" in entries or not isinstance(beside, dict):
        raise InputError("near must be a table {manifold, x, offset, z}, and stands in place of start")
    require_keys(entries, ("sigma", "mu", "until"))
    refuse_unknown(beside, _NEAR, "near")
    require_keys(beside, _NEAR)
    return Scene.near(beside.pop("manifold"), **read_constants("near", beside, angles=False), **entries)


def _from_rod(entries):
    require_keys(entries, (*(key for key in PHYSICAL if key != "f0"), "start", "until"))
    return Scene.physical(**entries)
