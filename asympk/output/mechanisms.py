"""The screen of ``asympk mechanism``: contact, paradox, rigid motions and jump of a mechanism in numbers."""

import math
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from itertools import chain
from shlex import quote
from types import MappingProxyType

import sympy as sp

from asympk.errors import InputError, NoMotion, NotDerivable, UnboundedReaction, Undecided
from asympk.mechanics import evaluation, paradox
from asympk.mechanics.checks import departures
from asympk.mechanics.described import Described, mechanism_of_table
from asympk.mechanics.jump_law import keeps_gap, rebound
from asympk.mechanics.rigid import motions
from asympk.numbers import number
from asympk.output.terminal import wrapped
from asympk.scenes.scenefile import is_file, scene_of_table
from asympk.shown import number_as_text
from asympk.storage.tomlfile import read_table
from asympk.symbolic.long import symbols_in
from asympk.symbolic.reading import as_floats
from asympk.systems.catalogue import described_mechanism

_LABEL = 16  # characters of a label on the left
_HELD = "; the lines below hold for g = g' = 0"
_DAMPINGS = (0, 1)  # the values of b in h = b sqrt(c) for which the rebound is given
ROUNDING = 1e-13  # relative to the largest velocity before a jump: smaller velocities after it are rounding errors


def load_mechanism(name: str) -> Described:
    """Return the ``Described`` mechanism of the catalogue called ``name``, or that of the TOML file ``name``.

    The file may also be that of a scene that holds a mechanism. Raises ``InputError`` for a scene without coordinates.
    """
    if not is_file(name):
        return described_mechanism(name)
    table = read_table(name)
    held = table["system"].get("mechanism") if isinstance(table.get("system"), dict) else None
    if held is None:
        return mechanism_of_table(table, name)
    scene, about = scene_of_table(table, name), table.get("about", "")
    if scene.origin is None:
        raise InputError(f"{name}: it starts from states of the system; give all coordinates and rates under [start]")
    mechanism, values, state = scene.origin[:3]
    if isinstance(held, str):
        return replace(described_mechanism(held), name=name, about=about, values=values, state=state)
    return Described(name, about, mechanism, values, state, None, followed=True)


def mechanism_as_text(described: Described, settings: Mapping[str, str] = MappingProxyType({})) -> str:
    """Return the whole screen on a ``Described`` mechanism; raises ``InputError`` where a number is missing.

    ``settings`` are the numbers by which it was changed, as given to ``--set``: the commands to go on with repeat them.
    """
    _require_numbers(described)
    numbers = ", ".join(f"{name} = {_short(value)}" for name, value in described.numbers.items())
    here, over, jump, mapped = _alone(described)
    rod = described.mechanism
    first, *others = (_departure(kinetics, rod.keyed(described.numbers)) for kinetics in rod.equations)
    rigid = [*here, *over, *motion_lines(described)]
    title = ": ".join(filter(None, (described.name, described.about)))
    off = ", ".join(f"{name} = {_short(value)}" for name, value in (first or {}).items())
    lines = [*wrapped("", title), *wrapped("at ", numbers)]
    lines += [f"off the contact: {off}{_HELD}"] if off else []
    lines += [*_others(rod.others, first, others), ""]
    if jump and any(other.unilateral and off == {} for other, off in zip(rod.others, others, strict=True)):
        jump[0] = f"{jump[0][:_LABEL]}of contact 1 alone: {jump[0][_LABEL:]}"
    for labelled in filter(None, (rigid, jump)):
        lines += [*(part for line in labelled for part in wrapped(line[:_LABEL], line[_LABEL:])), ""]
    return "\n".join([*lines, *_further(described, settings, first, mapped)])


def _alone(described):
    """Return lines on the contact, on the range of ``turn`` and on the jump, and whether to draw a map.

    Where its equations cannot be made, one line says why.
    """
    try:
        contact = contact_lines(described)
    except NotDerivable as reason:
        return [f"contact         {reason}"], [], [], False
    try:
        here = [*contact, _critical(described)]
    except NotDerivable as reason:
        return [*contact, f"critical        {reason}"], [], [], False
    over, mapped = _over_range(described)
    return here, over, jump_lines(described), mapped


def _require_numbers(described):
    """Raise ``InputError`` with all coordinates, rates and parameters that the contact depends on without a number."""
    rod = described.mechanism.plain
    needed = symbols_in(sp.Tuple(rod.slip, rod.friction, rod.static, rod.load))
    with suppress(NotDerivable):
        held = described.mechanism.held
        needed |= symbols_in(sp.Tuple(*held.delassus, *held.free, *chain(*paradox.pairs(held))))
    if missing := sorted(map(str, needed - {*described.mechanism.keyed(described.numbers)})):
        raise InputError(f"no value for {', '.join(missing)}; give each a number under [state]")


def _others(others, first, departed):
    """Return lines on the further contacts: which hold, which are taken as open, and which of these are closed here.

    There are no lines if there are no such contacts.
    """
    holding = sum(not other.unilateral for other in others)
    count, words = len(others) - holding, ""
    if holding:
        words = f"with {holding} other contact{'s' * (holding > 1)} that hold{'s' * (holding == 1)} both ways"
    if count:
        words += f"{' and' if holding else 'with'} {count} other contact{'s' * (count > 1)}, open in the lines below"
    closed = [str(k) for k, (other, off) in enumerate(zip(others, departed, strict=True), 2)
              if other.unilateral and off == {}]
    if closed:
        several = len(closed) > 1
        words += " but for the rigid motions and their paradox" if first == {} or holding else ""
        words += f"; contact{'s' * several} {', '.join(closed)} {'are' if several else 'is'} closed here, too"
    return wrapped("", words) if words else []


def _departure(kinetics, numbers):
    """Return what ``departures`` tells of a contact at the numbers, None where a coordinate has no number."""
    with suppress(InputError):
        return departures(kinetics, numbers)


def contact_lines(described: Described) -> list[str]:
    """Return the contact at the numbers, in lines: sliding velocity, Delassus matrix, free accelerations."""
    rod = described.mechanism
    parts = (rod.sliding_velocity, *(rod.delassus[i] for i in (0, 1, 3)), *rod.free)
    slip, G_NN, G_NT, G_TT, a_N, a_T = (_short(_value(described, part)) for part in parts)
    without = "; G and a are without the rough others" if rod.held.rough else ""
    return [f"contact         {rod.contact.side}; sliding velocity {slip}{without}",
            f"Delassus        G_NN = {G_NN}, G_NT = {G_NT}, G_TT = {G_TT}",
            f"free            a_N = {a_N}, a_T = {a_T}"]


def _value(described, expr):
    return described.mechanism.evaluate(expr, described.numbers)


def _critical(described):
    rod = described.mechanism
    critical = rod.critical_friction
    formula = str(critical).replace("(t)", "")
    shown = f"{formula} = " if critical != sp.oo and len(formula) < 90 + 150 * critical.has(sp.Min) else ""
    pairs = ((rod.own(normal), rod.own(rod.plain.load * mixed)) for normal, mixed in paradox.ratios(rod.held))
    pairs = ([_value(described, part) for part in pair] for pair in pairs)
    least = min(normal / mixed if mixed else math.copysign(math.inf, normal) for normal, mixed in pairs)
    value = "none" if least == math.inf else _short(max(least, 0))  # without a coupling of gap and slip there is none
    return f"critical        friction {shown}{value}: {_verdict(described)}"


def _over_range(described):
    """Return lines on the range of ``turn``, and whether the rigid motions can be drawn over it."""
    if described.turn is None:
        return [], False
    try:
        return _over(described, *described.turn), described.mapped
    except NotDerivable as reason:  # the contact does not close over the whole range
        return [f"over {described.turn[0]:11}{reason}"], False


def _over(described, name, low, high):
    rod = described.mechanism
    matter = {str(s) for s in symbols_in(paradox.condition(rod.held))}
    tied = {other: rule for other, rule in described.tied.items() if other in matter}
    given = {key: value for key, value in {**described.numbers, **tied}.items() if key != name}
    found = rod.paradox_set({name: (low, high)}, given)
    where = ", ".join(f"{_short(s.start)} .. {_short(s.end)}" for s in found.intervals)
    limits = "" if found.complete else ", as far as samples tell"
    slip = _way(rod) if rod.contact.unilateral else ""
    words = f"a paradox in {where}{slip}, within" if where else "no paradox in"
    ends = " .. ".join(number_as_text(number(name, end)) for end in (low, high))
    rates = {*map(str, rod.plain.velocities)} & {*tied}
    limits += "".join(f", where {other} closes the contact" for other in tied if other not in rates)
    limits += ", sliding as here" if rates else ""
    line = f"over {name:11}{words} {ends}{limits}"
    return [line] + ([] if tied.keys() - rates else _least(rod, name))


def _verdict(described):
    """Say whether there is a paradox at the numbers; a unilateral contact has it for one direction of slip alone."""
    excess, slides_into_it = _excess(described)
    if excess < 0:
        return "no paradox here"
    word = "a paradox" if excess else "exactly critical"
    return f"{word} here" if slides_into_it else f"{word}{_way(described.mechanism)}"


def _way(rod):
    """Return the words for the direction of slip with a paradox; beside rough contacts it may be either, or both."""
    return " for one direction of slip at least" if rod.held.rough else " for slip of the sign of G_NT"


def _excess(described):
    """Return the greatest sign of friction load |G_NT| - G_NN for all signs that friction of others may have.

    With it comes whether the contact slides in a direction with this sign, as a bilateral contact always does.
    """
    rod, excesses = described.mechanism, _excesses(described)
    slips = (_value(described, rod.own(rod.plain.slip * mixed)) for _, mixed in paradox.pairs(rod.held))
    towards = (excess for excess, slip in zip(excesses, slips, strict=True) if slip > 0)
    return max(excesses), not rod.contact.unilateral or max(towards, default=-2) == max(excesses)


def _excesses(described):
    """Return the sign of friction load |G_NT| - G_NN for each of ``pairs``, 0 where that is a rounding error."""
    rod, found = described.mechanism, []
    for normal, mixed in paradox.ratios(rod.held):
        sides = (rod.contact.friction * rod.contact.load * rod.own(mixed), rod.own(normal))
        above, below = (_value(described, side) for side in sides)
        small = abs(above - below) <= evaluation.ROUNDING * (above + abs(below))
        found.append(0 if small else 1 if above > below else -1)
    return found


def _least(rod, name):
    if name not in map(str, rod.plain.coordinates):
        return []
    try:
        least = rod.least_critical_friction(name)
    except NotDerivable:
        return []
    where = str(least.where.lhs).replace("(t)", "")
    friction, place = (_short(n) if n.has(sp.CRootOf) else n for n in (least.friction, least.where.rhs))
    return [f"least           friction {friction} where {where} = {place}"]


def motion_lines(described: Described) -> list[str]:
    """Return a line with the rigid motions at the numbers and the reactions R, R2, ... of each, or why it has none.

    Off a contact whose others may open, they are those of the contact alone, taken as closed, as is the whole screen.
    With others that only push and are closed comes a line on the paradox of all closed contacts.
    """
    rod, given = described.mechanism, described.mechanism.keyed(described.numbers)
    alone = all(other.unilateral for other in rod.others) and _departure(rod.plain, given) != {}
    several = not alone and any(other.unilateral and _departure(other, given) == {} for other in rod.equations[1:])
    try:
        found = motions(rod.plain, given) if alone else rod.motions(described.numbers)
        words = ", ".join(f"{name} with {_reactions(R)}" for name, R in found) or "none"
    except NoMotion as reason:  # as of a contact that is hit
        several, words = False, str(reason)
    except (UnboundedReaction, Undecided) as reason:  # as of a table on four legs
        words = str(reason)
    return [f"rigid motions   {words}"] + (_of_all(described) if several else [])


def _of_all(described):
    """Return the line on the paradox of all closed contacts, or none where forces that are not determined hide it."""
    with suppress(UnboundedReaction):
        words = ("some forces leave the closed contacts no motion or several"
                 if described.mechanism.has_paradox(described.numbers) else
                 "none of the closed contacts together: they have one motion under any forces")
        return [f"paradox         {words}"]
    return []


def _reactions(found):
    several = found if isinstance(found, tuple) else (found,)
    return " and ".join(f"R{k if k > 1 else ''} = {'undetermined' if math.isnan(R) else _short(R)}"
                        for k, R in enumerate(several, 1))


def jump_lines(described: Described) -> list[str]:
    """Return lines on the jump that starts at the numbers, or one line that says why there is none."""
    rod = described.mechanism
    try:
        law = rod.jump_law()
    except NotDerivable as reason:
        return [f"jump            {reason}"]
    excess, slides_into_it = _excess(described)
    if excess == 0 and slides_into_it:
        return ["jump            not determined at exactly the critical friction: follow the elastic contact"]
    given = {rate: described.numbers.get(str(rate), 0) for rate in rod.plain.velocities}
    least = ROUNDING * max(abs(as_floats(str(rate), value)) for rate, value in given.items())
    if abs(_value(described, rod.sliding_velocity)) <= least:
        return ["jump            none from here: the contact does not slide"]
    closed = law.condition.xreplace({rod.own(keeps_gap(rod.plain)): sp.true})  # a departure is told by its own line
    if not _value(described, closed):
        if excess > 0 and slides_into_it:
            return ["jump            no law: sliding goes on, as friction falls below the critical one before the stop,"
                    " or static friction is below the kinetic one at rest; follow the elastic contact"]
        return ["jump            none from here: no paradox, or the contact slides out of it"]
    normal, tangential = (_value(described, part) for part in law.impulses)
    rates = [float(_value(described, law.velocities[own])) for own in rod.velocities]
    after = ", ".join(f"{name} = {_short(rate if abs(rate) > least else 0)}"
                      for name, rate in zip(rod.plain.velocities, rates, strict=True))
    c, h = rod.plain.unused_symbol("c"), rod.plain.unused_symbol("h")
    alone = motions(rod.held, rod.keyed(described.numbers))  # the law is that of one contact
    beyond = "from beyond the divide of the two motions, " if alone else ""
    joints = ", ".join(_short(_value(described, part)) for part in law.joints)
    impulses = f"P_N = {_short(normal)}, P_T = {_short(tangential)}{f', {joints} of joints,' if joints else ''}"
    lines = [f"jump            {beyond}impulses {impulses} stop the contact",
             f"time            of order {c} log(1/{c}) with the compliance {c} of the contact",
             f"velocities      {after}",
             f"reaction        x gains P_N / {h} = {_short(normal)} / {h} with a constant damping time {h}"]
    if described.undamped is not None:
        lines[1] = "time            of order eps log(1/eps) with the compliance eps^2 of the contact"
        lines[-1] = "undamped        the contact rings on; --plot draws its plane (R, R')"
    return lines + (_rebounds(described) if rod.contact.unilateral else [])


def _rebounds(described):
    rod = described.mechanism
    bound = rod.plain.friction * rod.plain.load
    if _value(described, rod.free[0]) >= 0 or bound.has(*rod.plain.velocities):
        return []
    rates = [(b, _value(described, rod.own(rebound(rod.held, sp.Integer(b))))) for b in _DAMPINGS]
    c, h = rod.plain.unused_symbol("c"), rod.plain.unused_symbol("h")
    shown = ", ".join(f"g' = {_short(rate)} for {h} = {sp.Integer(b) * sp.sqrt(c)}" for b, rate in rates)
    return [f"rebound         {shown}{', with rigid joints' if rod.held.joints else ''}"]


def _further(described, settings, off, mapped):
    name, friction = quote(described.name), described.mechanism.contact.friction
    given = {key: f" --set {_quoted(f'{key}={value}')}" for key, value in settings.items()}
    others = "".join(words for key, words in given.items() if key != str(friction))
    lines = [f"asympk mechanism {name}{''.join(given.values())} --plot motions.svg"] if mapped else []
    if friction.is_Symbol and _value(described, friction) != 1 / 2:
        lines.append(f"asympk mechanism {name}{others} --set {friction}=1/2")
    plain = described.mechanism.plain
    moved = off or str(plain.time) in settings  # a motion is to start on the contact, at t = 0
    whole = described.state.keys() >= {*map(str, (*plain.coordinates, *plain.velocities))}
    if described.followed and whole and not (settings and moved):
        lines.append(f"asympk least {name}{''.join(given.values())}")
    return lines


def _quoted(setting):
    """Return a setting for a shell; a rate is easier to read in double quotes."""
    return f'"{setting}"' if "'" in setting and not {*setting} & {*'"$`\\!'} else quote(setting)


def _short(value):
    return f"{float(value) + 0.0:.6g}" if not isinstance(value, str | int) else str(value).lower()  # 1E-6 of a file
