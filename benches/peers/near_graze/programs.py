"""Programs that fly from a state to a time, or to where a component passes a level."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cache
from typing import TYPE_CHECKING, Any, Protocol

import heyoka as hy
import numpy as np
from numba import njit, types
from scipy.integrate import solve_ivp
from scipy.integrate._ivp import dop853_coefficients as dop

if TYPE_CHECKING:
    from collections.abc import Callable

    from oscillators import Field, Oscillator

MOST_CONTACTS = 30
LEVEL = 8  # place of the watched level among heyoka's parameters, behind those of every field
DIRECTIONS = {
    1: hy.event_direction.positive,
    -1: hy.event_direction.negative,
    0: hy.event_direction.any,
}
# A component, the level at which it is watched, and the way it passes: 1 up, -1 down, 0 either.
Watch = tuple[int, float, int]


@dataclass
class Leg:
    """A part of a flight without events: its field, and its start and last time."""

    field: Field
    parameters: list[float]
    time: float
    state: Any
    end: float
    watch: Watch | None = None


class Flyer(Protocol):
    """A program."""

    name: str
    settings: str

    def fly(self, leg: Leg) -> tuple[float, Any, bool]:
        """Give the time and state at the end or the event, and whether there was the event."""


class SciPy:
    """`scipy.integrate.solve_ivp` with a terminal event."""

    def __init__(self, rtol: float, atol: float) -> None:
        """Take the tolerances."""
        self.name = f"SciPy, {rtol:.0e}"
        self.settings = f"solve_ivp, DOP853, rtol {rtol:.0e}, atol {atol:.0e}, terminal event"
        self.tolerances = {"rtol": rtol, "atol": atol}

    def fly(self, leg: Leg) -> tuple[float, Any, bool]:
        """Fly to a time or an event."""
        events = None
        if leg.watch is not None:
            component, level, direction = leg.watch

            def gap(_t: float, s: Any) -> float:
                return float(s[component] - level)

            gap.terminal, gap.direction = True, direction
            events = [gap]
        rates = leg.field(math)
        flight = solve_ivp(
            lambda t, s: rates(t, s, leg.parameters),
            (leg.time, leg.end),
            leg.state,
            method="DOP853",
            events=events,
            **self.tolerances,
        )
        return flight.t[-1], flight.y[:, -1], flight.status == 1


ROW = types.float64[::1]
_STAGES, _EXTENDED = 12, 16
_A, _B, _C = dop.A[:_STAGES, :_STAGES].copy(), dop.B.copy(), dop.C.copy()
_A_EXTRA, _C_EXTRA, _D = dop.A[_STAGES + 1 :].copy(), dop.C[_STAGES + 1 :].copy(), dop.D.copy()
_E3, _E5 = dop.E3.copy(), dop.E5.copy()


RATES = types.void(types.float64, ROW, ROW, ROW)


@njit
def _dense(rates, t, h, s, new, p, k, out):
    """Write the coefficients of the dense output of a step."""
    for i in range(3):
        stage = _STAGES + 1 + i
        rates(t + _C_EXTRA[i] * h, s + h * (_A_EXTRA[i, :stage] @ k[:stage]), p, k[stage])
    out[0] = new - s
    out[1] = h * k[0] - out[0]
    out[2] = 2.0 * out[0] - h * (k[_STAGES] + k[0])
    out[3:] = h * (_D @ k)


@njit
def _inside(f, s, x):
    """Give the state at a share of a step."""
    out = np.zeros(s.size)
    for i in range(7):
        out += f[6 - i]
        out *= x if i % 2 == 0 else 1.0 - x
    return out + s


def _dop853(rates, p, t, s, end, component, level, way, looks, rtol, atol):
    """Fly by Dormand and Prince's method; an event is a change of sign from look to look."""
    n = s.size
    sign = 1.0 if end >= t else -1.0
    k, f = np.zeros((_EXTENDED, n)), np.zeros((7, n))
    rates(t, s, p, k[0])
    h = sign * min(1e-2, abs(end - t))
    while sign * (end - t) > 0.0:
        if sign * (t + h - end) > 0.0 or abs(t + h - end) < 1e-14 * abs(end):
            h = end - t
        for i in range(1, _STAGES):
            rates(t + _C[i] * h, s + h * (_A[i, :i] @ k[:i]), p, k[i])
        new = s + h * (_B @ k[:_STAGES])
        rates(t + h, new, p, k[_STAGES])
        scale = atol + rtol * np.maximum(np.abs(s), np.abs(new))
        fifth = np.sum(((_E5 @ k[: _STAGES + 1]) / scale) ** 2)
        third = np.sum(((_E3 @ k[: _STAGES + 1]) / scale) ** 2)
        error = 0.0
        if fifth > 0.0 or third > 0.0:
            error = abs(h) * fifth / np.sqrt((fifth + 0.01 * third) * n)
        if not np.isfinite(error):
            return t, s, False
        factor = 10.0 if error == 0.0 else min(10.0, max(0.2, 0.9 * error**-0.125))
        if error > 1.0:
            h *= min(factor, 1.0)
            continue
        if component >= 0:
            if looks > 1:
                _dense(rates, t, h, s, new, p, k, f)
            before, low = s[component] - level, 0.0
            for look in range(1, looks + 1):
                high = look / looks
                there = new if look == looks else _inside(f, s, high)
                after = there[component] - level
                up, down = before <= 0.0 < after, before >= 0.0 > after
                if (up and way >= 0) or (down and way <= 0):
                    if looks == 1:
                        _dense(rates, t, h, s, new, p, k, f)
                    for _ in range(60):
                        middle = 0.5 * (low + high)
                        if (_inside(f, s, middle)[component] - level > 0.0) == up:
                            high = middle
                        else:
                            low = middle
                    return t + high * h, _inside(f, s, high), True
                before, low = after, high
        t = end if h == end - t else t + h
        s = new
        k[0] = k[_STAGES]
        h *= factor
    return t, s, False


class Numba:
    """Dormand and Prince's method of order 8, written by hand and compiled by numba."""

    def __init__(self, rtol: float, atol: float, looks: int) -> None:
        """Take the tolerances and how often a step looks at a sign."""
        where = "" if looks == 1 else f", {looks} looks"
        self.name = f"numba, {rtol:.0e}{where}"
        places = (
            "the ends of steps" if looks == 1 else f"{looks} places of the dense output of a step"
        )
        self.settings = (
            f"DOP853 by hand, rtol {rtol:.0e}, atol {atol:.0e}, signs at {places}, bisection"
        )
        self.options = (looks, rtol, atol)

    def fly(self, leg: Leg) -> tuple[float, Any, bool]:
        """Fly to a time or an event."""
        return method()(
            compiled(leg.field),
            np.array(leg.parameters),
            float(leg.time),
            np.array(leg.state),
            float(leg.end),
            *(leg.watch or (-1, 0.0, 0)),
            *self.options,
        )


@cache
def method() -> Any:
    """Compile the method, once for all fields."""
    number, whole = types.float64, types.int64
    result = types.Tuple((number, ROW, types.boolean))
    start = (types.FunctionType(RATES), ROW, number, ROW, number)
    return njit(result(*start, whole, number, whole, whole, number, number))(_dop853)


@cache
def compiled(field: Field) -> Any:
    """Compile a field that writes its rates."""
    inner = njit(field(math))

    def write(t: float, s: Any, p: Any, out: Any) -> None:
        values = inner(t, s, p)
        for i in range(s.size):
            out[i] = values[i]

    return njit(RATES)(write)


class Heyoka:
    """heyoka's Taylor method with a terminal event."""

    def __init__(self) -> None:
        """Start without integrators."""
        self.name = "heyoka"
        self.settings = "taylor_adaptive, default tolerance, order 20, terminal event"
        self.integrators: dict[Any, Any] = {}

    @staticmethod
    def equations(leg: Leg) -> Any:
        """Give the states and the field as heyoka takes them."""
        states = hy.make_vars(*[f"s{i}" for i in range(len(leg.state))])
        rates = leg.field(hy)(hy.time, states, [hy.par[i] for i in range(LEVEL)])
        return states, list(zip(states, rates, strict=True))

    def placed(self, key: Any, make: Callable[[], Any], leg: Leg, state: Any) -> Any:
        """Give an integrator at a start; it has as many parameters as its field uses."""
        if key not in self.integrators:
            self.integrators[key] = make()
        integrator = self.integrators[key]
        integrator.time, integrator.state[:] = leg.time, state
        used = min(len(leg.parameters), len(integrator.pars))
        integrator.pars[:used] = leg.parameters[:used]
        return integrator

    def fly(self, leg: Leg) -> tuple[float, Any, bool]:
        """Fly to a time or an event."""
        watch = leg.watch

        def make() -> Any:
            states, equations = self.equations(leg)
            events = []
            if watch is not None:
                way = DIRECTIONS[watch[2]]
                events = [hy.t_event(states[watch[0]] - hy.par[LEVEL], direction=way)]
            return hy.taylor_adaptive(equations, [0.0] * len(states), t_events=events)

        key = (leg.field, watch and (watch[0], watch[2]))
        integrator = self.placed(key, make, leg, leg.state)
        if watch is not None:
            integrator.pars[LEVEL] = watch[1]
            integrator.reset_cooldowns()
        outcome = integrator.propagate_until(leg.end)[0]
        hit = outcome != hy.taylor_outcome.time_limit
        return integrator.time, integrator.state.copy(), hit

    def variations(self, leg: Leg, matrix: Any) -> Any:
        """Carry a matrix of variations along a leg."""
        n = len(leg.state)

        def make() -> Any:
            varied = hy.var_ode_sys(self.equations(leg)[1], hy.var_args.vars, order=1)
            return hy.taylor_adaptive(varied, [0.0] * n)

        start = np.concatenate([leg.state, matrix.ravel()])
        integrator = self.placed((leg.field, "variations"), make, leg, start)
        integrator.propagate_until(leg.end)
        return integrator.state[n:].reshape(n, n).copy()


@dataclass
class Flight:
    """A flight with impacts."""

    state: Any
    contacts: int
    legs: list[Leg]


def simulate(program: Flyer, oscillator: Oscillator, time: float, state: Any, end: float) -> Flight:
    """Fly with all impacts."""
    o, legs = oscillator, []
    outside = (0, o.stop, o.side)
    for contacts in range(MOST_CONTACTS):
        leg = Leg(o.free, o.parameters, time, state, end, outside)
        time, state, hit = program.fly(leg)
        legs.append(replace(leg, end=time))
        if not hit:
            return Flight(state, contacts, legs)
        state = np.array(state)
        if o.contact is None:
            state[1] *= -o.restitution
            continue
        leg = Leg(o.contact, o.parameters, time, state, end, (0, o.stop, -o.side))
        time, state, hit = program.fly(leg)
        legs.append(replace(leg, end=time))
        if not hit:
            return Flight(state, contacts + 1, legs)
    return Flight(state, MOST_CONTACTS, legs)


def fixed_times(program: Heyoka, oscillator: Oscillator, flight: Flight) -> Any:
    """Give the derivatives by the start with the times of events held fixed."""
    matrix = np.eye(len(flight.state))
    for place, leg in enumerate(flight.legs):
        if place > 0 and oscillator.contact is None:
            matrix[1] *= -oscillator.restitution
        matrix = program.variations(leg, matrix)
    return matrix
