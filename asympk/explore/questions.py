"""The questions of the page, read from JSON and answered: the motion, the curves around it, the least model."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from asympk.errors import InputError
from asympk.explore.motion import motion
from asympk.explore.surroundings import surroundings
from asympk.formulas import read_constant
from asympk.numbers import number, short, whole
from asympk.scene import Scene
from asympk.scenes.turned import turned
from asympk.storage.tomlfile import refuse_unknown

KEYS = ("scene", "parameters", "start", "until")
MOST_PLACES = 1000  # of a grid
SECONDS_OF_LADDER = 15  # after which no further rung is tried


@dataclass(frozen=True)
class Question:
    """A kind of question: the function that answers it, the seconds it may take, and its keys beside ``KEYS``.

    The process that answers imports ``modules`` when it starts.
    """

    answer: Callable[[tuple[Scene, ...], dict[str, Any]], Any]
    seconds: float
    keys: tuple[str, ...] = ()
    modules: tuple[str, ...] = ()

    def __call__(self, scenes: tuple[Scene, ...], asked: Any) -> bytes:
        """Return the answer as JSON; raises ``InputError`` for a malformed question."""
        return as_json(self.answer(scenes, _read(asked, (*KEYS, *self.keys))))


def as_json(thing: Any) -> bytes:
    """Return an object of strings, finite numbers, lists and dictionaries as JSON."""
    return json.dumps(thing, allow_nan=False).encode()


def _motion(scenes: tuple[Scene, ...], asked: dict[str, Any]) -> Any:
    draft = asked.get("draft", False)
    if not isinstance(draft, bool):
        raise InputError(f"draft = {short(draft)}: it must be true or false")
    return motion(_scene(scenes, asked), draft)


def _surroundings(scenes: tuple[Scene, ...], asked: dict[str, Any]) -> Any:
    scene = _scene(scenes, asked)
    pair = asked.get("pair")
    if not isinstance(pair, list) or len(pair) != 2 or not all(isinstance(name, str) for name in pair):
        raise InputError(f"pair = {short(pair)}: it must be the names of two quantities")
    return surroundings(scene, pair, _grid(asked, "across"), _grid(asked, "up"))


def _least(scenes: tuple[Scene, ...], asked: dict[str, Any]) -> Any:
    from asympk.studies.least import least_model

    rtol = read_constant("rtol", asked.get("rtol", "1e-3"), angles=False)
    return least_model(_scene(scenes, asked), rtol, SECONDS_OF_LADDER).as_dict()


QUESTIONS = {
    "motion": Question(_motion, 60, ("draft",), ("scipy.integrate", "scipy.optimize")),
    "surroundings": Question(_surroundings, 120, ("pair", "across", "up")),
    "least": Question(_least, 120, ("rtol",)),
}


def _read(asked: Any, known: tuple[str, ...]) -> dict[str, Any]:
    if not isinstance(asked, dict):
        raise InputError(f"a question is a JSON object, not {short(asked)}")
    refuse_unknown(asked, known, "question")
    return asked


def _scene(scenes: tuple[Scene, ...], asked: dict[str, Any]) -> Scene:
    which = whole("scene", asked.get("scene", 0), 0, len(scenes) - 1)
    given = {key: asked.get(key, {}) for key in ("parameters", "start")}
    for key, table in given.items():
        if not isinstance(table, dict):
            raise InputError(f"{key} = {short(table)}: it must be an object of numbers by name")
    scene = scenes[which]
    following = {s.name for s in scene.system.dependent} if scene.system is not None else set()  # no drag moves these
    begun = {name: value for name, value in given["start"].items() if name not in following}
    return turned(scene, given["parameters"], begun, asked.get("until"))


def _grid(asked: dict[str, Any], key: str) -> list[float]:
    values = asked.get(key)
    if not isinstance(values, list) or not 1 <= len(values) <= MOST_PLACES:
        raise InputError(f"{key} = {short(values)}: it must be a list of 1 to {MOST_PLACES} numbers")
    return [float(number(key, value)) for value in values]
