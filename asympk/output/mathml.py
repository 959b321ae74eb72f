r"""The LaTeX that tables, captions and derived formulas use, as MathML; no more of LaTeX than that.

A formula is a row of atoms, each with its scripts. An atom is a letter, a number, an operator, a group, or a command.
"""

import re
from html import escape

from asympk.errors import InputError

_LETTERS = {
    "alpha": "α", "beta": "β", "delta": "δ", "kappa": "κ", "lambda": "λ", "mu": "μ", "nu": "ν", "xi": "ξ", "zeta": "ζ",
    "rho": "ρ", "sigma": "σ", "tau": "τ", "varepsilon": "ε", "Pi": "Π", "Gamma": "Γ", "Delta": "Δ", "Lambda": "Λ",
    "gamma": "γ", "theta": "θ", "phi": "φ", "pi": "π", "infty": "∞", "varnothing": "∅",
}  # fmt: skip
_SIGNS = {"le": "≤", "ge": "≥", "ne": "≠", "to": "→", "pm": "±", "cup": "∪", "times": "×", "cdot": "·", "in": "∈"}
_FUNCTIONS = ("log", "ln", "cos", "sin", "tan", "exp")
_SPACES = {",": "0.17em", ";": "0.28em", "quad": "1em", "qquad": "2em", " ": "0.25em"}
_DELIMITERS = ("left", "right", "bigl", "bigr", "Bigl", "Bigr")
_LOOKS = {  # no space inside brackets, wherever they stand in a row
    "/": ' lspace="0" rspace="0"', "|": ' stretchy="false"',
    **dict.fromkeys("([", ' form="prefix" stretchy="false"'), **dict.fromkeys(")]", ' form="postfix" stretchy="false"'),
}  # fmt: skip
_SILENT = ("ensuremath", "displaystyle", "notag")
_SIGN = re.compile(r"(<mo[^>]*>(?:[(\[=≤≥,→]|&lt;|&gt;)</mo>)<mo>(?=[−±]<)")  # a minus there is no operator between two
_LOW = re.compile(  # a pair of brackets that might stretch, around nothing high
    r'<mo form="prefix">([(\[])</mo>((?:(?!<mfrac|<msqrt|<mo form="prefix">[(\[]<).)*?)<mo form="postfix">([)\]])</mo>')
_TOKEN = re.compile(r"\\([A-Za-z]+|.)|(\d+(?:\.\d+)?)|(\S)|(\s+)", re.DOTALL)


def mathml(latex, block=False):
    r"""Return the formula ``latex`` as a ``math`` element; raises ``InputError`` for a command that is not known.

    >>> mathml(r"\sigma_0 > 1")
    '<math><mrow><msub><mi>σ</mi><mn>0</mn></msub><mo>&gt;</mo><mn>1</mn></mrow></math>'
    """
    tokens = [found.groups() for found in _TOKEN.finditer(latex) if not found[4]]
    row, rest = _row(tokens[::-1], latex)
    if rest:
        raise InputError(f"{latex}: a brace too many")
    row = _SIGN.sub(r'\1<mo form="prefix">', _unstretched(row))
    return f'<math display="block">{row}</math>' if block else f"<math>{row}</math>"


def _unstretched(row):
    """Keep brackets around low things from stretching: browsers set those that may with more space around them."""
    held = _LOW.sub(r'<mo form="prefix" stretchy="false">\1</mo>\2<mo form="postfix" stretchy="false">\3</mo>', row)
    return held if held == row else _unstretched(held)


def _row(stack, latex, braced=False):
    """Read atoms from the top of ``stack`` up to a closing brace; return the row and what is left."""
    parts = []
    while stack and stack[-1][2] != "}":
        parts.append(_scripted(stack, latex))
    if braced:
        if not stack:
            raise InputError(f"{latex}: a brace is not closed")
        stack.pop()
    return f"<mrow>{''.join(parts)}</mrow>", stack


def _scripted(stack, latex):
    function = stack[-1][0] in _FUNCTIONS
    base, scripts = _atom(stack, latex), {}
    while stack and stack[-1][2] in ("_", "^", "'"):
        kind = stack.pop()[2]
        if kind == "'":
            scripts["^"] = f"<mo>{'′' * (1 + _primes(stack))}</mo>"
        else:
            scripts[kind] = _argument(stack, latex)
    if not scripts and base.startswith("<mrow>"):
        return base[6:-7]  # a bare group is part of its row, so that a minus at its start is an operator there
    whole = _with(base, scripts)
    return f"<mspace width='0.15em'/>{whole}<mspace width='0.1em'/>" if function else whole


def _with(base, scripts):
    if len(scripts) == 2:
        return f"<msubsup>{base}{scripts['_']}{scripts['^']}</msubsup>"
    for kind, script in scripts.items():
        tag = "msub" if kind == "_" else "msup"
        return f"<{tag}>{base}{script}</{tag}>"
    return base


def _argument(stack, latex):
    """Read an argument without braces as TeX does: of a number its first digit alone."""
    if stack and stack[-1][1]:
        number = stack.pop()[1]
        if number[1:]:
            stack.append((None, number[1:], None, None))
        return f"<mn>{number[0]}</mn>"
    return _atom(stack, latex)


def _primes(stack):
    count = 0
    while stack and stack[-1][2] == "'":
        stack.pop()
        count += 1
    return count


def _atom(stack, latex):
    if not stack:
        raise InputError(f"{latex}: something is missing at the end")
    command, number, sign, _ = stack.pop()
    if command is not None:
        return _command(command, stack, latex)
    if number:
        return f"<mn>{number}</mn>"
    if sign == "{":
        return _row(stack, latex, braced=True)[0]
    if sign.isalpha():
        return f"<mi>{sign}</mi>"
    return f"<mo{_LOOKS.get(sign, '')}>{'−' if sign == '-' else escape(sign)}</mo>"


def _command(name, stack, latex):
    if name in _LETTERS:
        return f"<mi>{_LETTERS[name]}</mi>"
    if name in _SIGNS:
        return f"<mo>{_SIGNS[name]}</mo>"
    if name in _FUNCTIONS:
        return f"<mi>{name}</mi>"
    if name in _SPACES:
        return f"<mspace width='{_SPACES[name]}'/>"
    if name in ("frac", "tfrac", "dfrac"):
        return f"<mfrac>{_argument(stack, latex)}{_argument(stack, latex)}</mfrac>"
    if name == "sqrt":
        return f"<msqrt>{_argument(stack, latex)}</msqrt>"
    if name == "dot":
        return f"<mover>{_argument(stack, latex)}<mo>˙</mo></mover>"
    if name in _DELIMITERS:
        return _atom(stack, latex).replace(' stretchy="false"', "")
    if name in _SILENT:
        return _atom(stack, latex)
    if name in "{}|":
        return f"<mo>{name}</mo>"
    raise InputError(f"{latex}: \\{name} has no MathML here; add it to mathml.py")
