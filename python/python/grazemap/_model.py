"""Scenes from Python values: stops, forcing, expressions, and the text that the parser reads."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from . import _lib, _toml
from ._errors import InputError, SceneError

if TYPE_CHECKING:
    from collections.abc import Sequence

#: Text, number or SymPy expression.
Expression: TypeAlias = Any

_NAME = re.compile(r"[A-Za-z_]\w*")


@dataclass(frozen=True)
class Phase:
    """Periodic forcing: a phase with a constant rate.

    Parameters
    ----------
    name
        Name of the phase in expressions.
    rate
        Rate of the phase: an expression of parameters.
    period
        Period of everything that depends on the phase: an expression of numbers.

    Examples
    --------
    >>> Phase("theta", rate="omega")
    Phase(name='theta', rate='omega', period='2*pi')

    """

    name: Any
    rate: Expression = "omega"
    period: Expression = "2*pi"


class _Stop:
    """Base of stops."""

    event: Expression
    name: str | None

    def keys(self, model: Model, argument: str) -> dict[str, object]:
        """Give the keys of the surface beside its name."""
        raise NotImplementedError


@dataclass(frozen=True)
class Rigid(_Stop):
    """Rigid stop: an impact changes states at once.

    Parameters
    ----------
    event
        Gap, an expression: positive in free flight, zero at the stop.
    restitution
        Coefficient of restitution, 0 to 1, for a gap that depends on one position: a state whose
        rate is another state, the velocity. The velocity relative to the stop is reversed and
        multiplied by it.
    velocity
        Velocity of the stop, for one that moves.
    impact
        Instead of ``restitution``: states after an impact by name; those not named stay.
    name
        Name of the stop (default: ``"stop"``; ``"stop1"``, ``"stop2"``, ... of several).

    Examples
    --------
    >>> Rigid("delta - x", restitution="r").restitution
    'r'

    """

    event: Expression
    restitution: Expression | None = None
    velocity: Expression | None = None
    impact: Mapping[Any, Expression] | None = None
    name: str | None = None

    def keys(self, model: Model, argument: str) -> dict[str, object]:
        """Give the keys of the surface beside its name."""
        if (self.restitution is None) == (self.impact is None):
            message = f"{argument}: expected `restitution` or `impact`, one of them"
            raise InputError(message)
        if self.impact is not None:
            return {
                "event": text(self.event),
                "impact": _by_name(f"{argument}.impact", self.impact),
            }
        state = model.velocity(self, argument)
        factor = _factor(text(self.restitution))
        after = f"-{factor}*{state}"
        if self.velocity is not None:
            after += f" + (1 + {factor})*{_factor(text(self.velocity))}"
        return {"event": text(self.event), "impact": {state: after}}


@dataclass(frozen=True)
class Compliant(_Stop):
    """Soft stop: rates change while it is touched.

    Parameters
    ----------
    event
        Gap, an expression: positive in free flight, zero at the stop.
    contact
        Rates in contact by state; those not named stay free. ``free`` stands for the rate in free
        flight: ``{"v": "free - k*(x - delta)"}``.
    release
        Expression at whose zero the contact ends (default: the gap).
    name
        Name of the stop (default: ``"stop"``; ``"stop1"``, ``"stop2"``, ... of several).

    Examples
    --------
    >>> Compliant("delta - x", contact={"v": "free - k*(x - delta)"}).event
    'delta - x'

    """

    event: Expression
    contact: Mapping[Any, Expression]
    release: Expression | None = None
    name: str | None = None

    def keys(self, model: Model, argument: str) -> dict[str, object]:
        """Give the keys of the surface beside its name."""
        del model
        release = None if self.release is None else text(self.release)
        contact = _by_name(f"{argument}.contact", self.contact)
        return {"event": text(self.event), "contact": contact, "release": release}


class Model:
    """Text of a scene, with the argument that each line is written from."""

    def __init__(self, name: str) -> None:
        """Begin the text of a scene."""
        if not isinstance(name, str) or not name:
            message = f"name: expected a text, found {name!r}"
            raise InputError(message)
        self._name = name
        self._lines: list[str] = []
        #: Argument of each line.
        self._arguments: list[str] = []
        self._states: list[str] = []
        self._parameters: dict[str, object] = {}
        self._flow: dict[str, str] = {}
        self._let: dict[str, str] = {}
        self._phase: str | None = None

    def states(
        self,
        states: Iterable[object],
        flow: Mapping[Any, Expression],
        parameters: Mapping[Any, Expression],
        let: Mapping[Any, Expression],
        phase: Phase | None,
    ) -> None:
        """Write the model without its stops."""
        named = [states] if isinstance(states, str) else states
        self._states = [text(state) for state in named]
        self._flow, self._let = _by_name("flow", flow), _by_name("let", let)
        self._parameters = _values("parameters", parameters)
        self._line("", "[model]")
        self._line("name", f"name = {_toml.value(self._name)}")
        self._line("states", f"states = {_toml.value(self._states)}")
        self._by_line("model.parameters", "parameters", self._parameters)
        self._by_line("model.let", "let", self._let)
        if phase is not None:
            if not isinstance(phase, Phase):
                message = f"phase: expected a grazemap.Phase, found {phase!r}"
                raise InputError(message)
            self._phase = text(phase.name)
            self._line("phase", "[model.phase]")
            self._line("phase.name", f"name = {_toml.value(self._phase)}")
            self._line("phase.rate", f"rate = {_toml.value(text(phase.rate))}")
            self._line("phase.period", f"period = {_toml.value(_value(phase.period))}")
        self._line("flow", "[model.flow]")
        for state, rate in self._flow.items():
            self._line(f"flow[{state!r}]", f"{_key(state)} = {_toml.value(rate)}")

    def stops(self, stops: Sequence[object]) -> None:
        """Write the stops."""
        for place, stop in enumerate(stops):
            argument = f"stops[{place}]"
            if not isinstance(stop, _Stop):
                message = f"{argument}: expected a grazemap.Rigid or a grazemap.Compliant, found "
                raise InputError(message + repr(stop))
            name = stop.name or ("stop" if len(stops) == 1 else f"stop{place + 1}")
            self._line(argument, "[[model.surface]]")
            self._line(f"{argument}.name", f"name = {_toml.value(name)}")
            for key, value in stop.keys(self, argument).items():
                if value is not None:
                    self._line(f"{argument}.{key}", f"{key} = {_toml.value(value)}")

    def table(self, name: str, **keys: object) -> None:
        """Write a table of keys that have the names of arguments; omit those that are ``None``."""
        self._line(name, f"[{name}]")
        for key, value in keys.items():
            if value is not None:
                argument = "section" if name == "section" else key
                self._line(argument, f"{key} = {_toml.value(_plain(argument, value))}")

    def window(self, bounds: Mapping[Any, float]) -> None:
        """Write the bounds of the window."""
        if not bounds:
            return
        given = _values("window", bounds)
        self._line("window", "[window]")
        if "depth" in given:
            self._line("window['depth']", f"depth = {_toml.value(given.pop('depth'))}")
        for key, is_parameter in (("state", False), ("parameter", True)):
            own = {name: held for name, held in given.items() if self._has(name) == is_parameter}
            if own:
                self._line("window", f"{key} = {_toml.value(own)}")

    def velocity(self, stop: Rigid, argument: str) -> str:
        """Give the velocity that an impact on a stop reverses."""
        used = self._used(text(stop.event))
        positions = [state for state in self._states if state in used]
        if len(positions) != 1 or self._flow.get(positions[0], "").strip() not in self._states:
            message = f"{argument}.restitution: expected a gap of one position, a state whose rate "
            message += "is another state; name the states after an impact by `impact` instead"
            raise InputError(message)
        if self._phase in used and stop.velocity is None:
            message = f"{argument}.velocity: the stop moves; expected its velocity, an expression"
            raise InputError(message)
        return self._flow[positions[0]].strip()

    def parse(self) -> _lib.Scene:
        """Parse the text; a fault names the argument."""
        written = "\n".join(self._lines) + "\n"
        try:
            return _lib.Scene.parse(written, f"{self._name}.toml", [])
        except SceneError as fault:
            words = fault.words
            if fault.line is not None and (argument := self._arguments[fault.line - 1]):
                words = f"{argument}: {words}"
            raise SceneError(words, fault.file, None, None) from None

    def _has(self, name: str) -> bool:
        """Tell whether a name is that of a parameter."""
        return name in self._parameters

    def _used(self, expression: str) -> set[str]:
        """Give the names in an expression, through named expressions."""
        used: set[str] = set()
        waiting = _NAME.findall(expression)
        while waiting:
            name = waiting.pop()
            if name not in used:
                used.add(name)
                waiting += _NAME.findall(self._let.get(name, ""))
        return used

    def _by_line(self, table: str, argument: str, values: Mapping[str, object]) -> None:
        """Write a table with a line for each value."""
        if values:
            self._line(argument, f"[{table}]")
        for name, value in values.items():
            self._line(f"{argument}[{name!r}]", f"{_key(name)} = {_toml.value(value)}")

    def _line(self, argument: str, line: str) -> None:
        self._lines.append(line)
        self._arguments.append(argument)


def text(item: Expression) -> str:
    """Write an expression: a text as it is, a number, a SymPy expression.

    >>> text("x^2"), text(0.1)
    ('x^2', '0.1')
    """
    if isinstance(item, str):
        return item
    if isinstance(item, np.generic):
        item = item.item()
    if isinstance(item, (int, float)) and not isinstance(item, bool):
        return repr(item)
    if hasattr(item, "free_symbols"):
        return _of_sympy(item)
    message = f"expected an expression: a text, a number or a SymPy expression, found {item!r}"
    raise InputError(message)


def _of_sympy(item: Any) -> str:
    """Write a SymPy expression in the language of scenes."""
    from sympy import Float
    from sympy.core.function import AppliedUndef
    from sympy.printing.str import StrPrinter

    def several(name: str, arguments: Sequence[Any]) -> str:
        first, *rest = arguments
        if not rest:
            return str(printer.doprint(first))
        return f"{name}({printer.doprint(first)}, {several(name, rest)})"

    def number(number: Any) -> str:
        # Doubles to the last bit, others with all their digits.
        held = float(number)
        return repr(held) if Float(held) == number else str(plain.doprint(number))

    plain = StrPrinter({"full_prec": True})
    printer = StrPrinter()
    printer._print_Float = number
    printer._print_Abs = lambda one: f"abs({printer.doprint(one.args[0])})"
    printer._print_Max = lambda one: several("max", one.args)
    printer._print_Min = lambda one: several("min", one.args)
    printer._print_Exp1 = lambda _: "exp(1)"
    function = printer._print_Function
    printer._print_Function = lambda one: (
        one.func.__name__ if isinstance(one, AppliedUndef) else function(one)
    )
    return str(printer.doprint(item)).replace("**", "^")


def _value(item: Any) -> object:
    """Give a number as it is, anything else as an expression."""
    is_number = isinstance(item, (int, float, np.integer, np.floating))
    return item if is_number and not isinstance(item, bool) else text(item)


def _values(argument: str, values: Any) -> dict[str, object]:
    """Give numbers or expressions by name."""
    return {name: _value(value) for name, value in _mapping(argument, values).items()}


def _by_name(argument: str, values: Any) -> dict[str, str]:
    """Give expressions by name."""
    return {name: text(value) for name, value in _mapping(argument, values).items()}


def _mapping(argument: str, values: Any) -> dict[str, Any]:
    """Give values by name."""
    if not isinstance(values, Mapping):
        message = f"{argument}: expected expressions by name, such as {{'x': 'v'}}, "
        raise InputError(message + f"found {values!r}")
    return {text(name): value for name, value in values.items()}


def _plain(argument: str, value: Any) -> object:
    """Give the value of a key, with symbols as texts."""
    if isinstance(value, (str, int, float, np.integer, np.floating)):
        return value
    if isinstance(value, Mapping):
        return _values(argument, value)
    if isinstance(value, Iterable):
        return [text(one) for one in value]
    return text(value)


def _key(name: str) -> str:
    """Write a key of TOML."""
    return name if _NAME.fullmatch(name) else json.dumps(name)


def _factor(expression: str) -> str:
    """Write an expression as a factor, in parentheses unless it is a name or a number."""
    return expression if re.fullmatch(r"\w+(\.\w+)?", expression) else f"({expression})"
