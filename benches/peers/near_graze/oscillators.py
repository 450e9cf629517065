"""Oscillators with a stop, written for every program from one text."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

Rates = Callable[[Any, Any, Any], Any]
# Makes a field of `math` or `heyoka`: of time, states (position, velocity, ...) and parameters.
Field = Callable[[Any], Rates]


def linear(m: Any) -> Rates:
    """Give a forced linear oscillator."""

    def rates(t: Any, s: Any, p: Any) -> Any:
        return s[1], p[0] * m.cos(p[1] * t) - p[2] * s[1] - p[3] * s[0]

    return rates


def spring(m: Any) -> Rates:
    """Give that oscillator on a spring and damper from `p[7]`, preloaded by a length `p[6]`."""

    def rates(t: Any, s: Any, p: Any) -> Any:
        free = p[0] * m.cos(p[1] * t) - p[2] * s[1] - p[3] * s[0]
        return s[1], free - p[4] * (s[0] - p[7] + p[6]) - p[5] * s[1]

    return rates


def electrostatic(m: Any) -> Rates:
    """Give the electrostatic oscillator."""

    def rates(t: Any, s: Any, p: Any) -> Any:
        force = p[0] * m.sin(p[1] * t) / (1.0 - s[0])
        return s[1], force * force - p[2] * s[1] - s[0]

    return rates


def beam(m: Any) -> Rates:
    """Give the cantilever beam."""

    def rates(t: Any, s: Any, p: Any) -> Any:
        restoring = p[1] * (s[0] + (36.0 / 35.0) * s[0] * s[0] * s[0])
        return s[1], p[2] * m.cos(t) - p[0] * s[1] - restoring

    return rates


def van_der_pol(_: Any) -> Rates:
    """Give the van der Pol oscillator."""

    def rates(_t: Any, s: Any, _p: Any) -> Any:
        return s[1], (1.0 - s[0] * s[0]) * s[1] - s[0]

    return rates


def valve(m: Any) -> Rates:
    """Give the relief valve."""

    def rates(_t: Any, s: Any, p: Any) -> Any:
        return (
            s[1],
            s[2] - p[0] * s[1] - (s[0] + p[1]),
            p[2] * (p[3] - s[0] * m.sqrt(s[2])),
        )

    return rates


@dataclass
class Oscillator:
    """An oscillator with a stop."""

    free: Field
    parameters: list[float]
    stop: float
    restitution: float = 1.0
    contact: Field | None = None
    side: int = 1
    """1 if the stop lies above, -1 if below."""

    def at(self, stop: float) -> Oscillator:
        """Move the stop."""
        parameters = list(self.parameters)
        if self.contact is not None:
            parameters[-1] = stop
        return Oscillator(self.free, parameters, stop, self.restitution, self.contact, self.side)


@dataclass
class Case:
    """A scene with the stop that is moved, and how its oscillator is written here."""

    name: str
    scene: str
    stop: str
    oscillator: Callable[[dict[str, float]], Oscillator]
    rate: str | float | None
    """The rate of the phase: a parameter, or a number; none without a phase."""
    period: float = math.tau
    sets: list[str] = field(default_factory=list)


def resonance(p: dict[str, float]) -> Oscillator:
    """Give the oscillator of Dankowicz and Schilder."""
    return Oscillator(linear, [p["A"], 1.0, 2 * p["zeta"], 1.0], p["gap"], p["e"])


def elastic(p: dict[str, float]) -> Oscillator:
    """Give the oscillator with a stop without loss."""
    stiffness = (p["n"] / 2) ** 2 + p["g"] ** 2 / 4
    return Oscillator(linear, [p["F"], 1.0, p["g"], stiffness], p["gap"], p["r"])


CASES = [
    Case(
        "linear_w1.8",
        "crates/sim/scenes/linear.toml",
        "delta",
        lambda p: Oscillator(
            linear, [p["alpha"], p["omega"], 2 * p["zeta"], 1.0], p["delta"], p["r"]
        ),
        "omega",
    ),
    Case(
        "mems_w0.46",
        "crates/sim/scenes/mems.toml",
        "delta",
        lambda p: Oscillator(
            electrostatic, [p["V"], p["omega"], 2 * p["zeta"]], p["delta"], p["r"]
        ),
        "omega",
        math.pi,
    ),
    Case(
        "cantilever_zeta0.107",
        "crates/sim/scenes/cantilever_0_107.toml",
        "Q",
        lambda p: Oscillator(beam, [p["zeta"], p["alpha"], p["beta"]], p["Q"], p["r"], side=-1),
        1.0,
        sets=['grazing.solve_for="beta"'],
    ),
    Case(
        "soft_A1",
        "crates/sim/scenes/soft_a.toml",
        "sigma",
        lambda p: Oscillator(
            linear,
            [p["A"], p["omega"], p["R1"], p["k1"], p["k2"], 0.0, 0.0, p["sigma"]],
            p["sigma"],
            contact=spring,
        ),
        "omega",
    ),
    Case(
        "impact_at_resonance",
        "gallery/outside/scenes/impact_at_resonance.toml",
        "gap",
        resonance,
        1.0,
        sets=["model.parameters.gap=1", 'model.surface.0.event="gap - x"'],
    ),
    Case(
        "elastic_stop",
        "gallery/outside/scenes/elastic_stop.toml",
        "gap",
        elastic,
        1.0,
        sets=["model.parameters.gap=1", 'model.surface.0.event="gap - x"'],
    ),
    Case(
        "bilinear_rig",
        "gallery/outside/scenes/bilinear_rig.toml",
        "e",
        lambda p: Oscillator(
            linear,
            [p["a"] * p["w"] ** 2, p["w"], 2 * p["zeta"], 1.0, p["beta"], 0.0, 0.0, p["e"]],
            p["e"],
            contact=spring,
        ),
        "w",
    ),
    Case(
        "soft_impact",
        "gallery/outside/scenes/soft_impact.toml",
        "g",
        lambda p: Oscillator(
            linear,
            [p["beta"], p["omega"], 2 * p["xi"], 1.0, p["alpha"], 0.0, 0.0, p["g"]],
            p["g"],
            contact=spring,
        ),
        "omega",
    ),
    Case(
        "van_der_pol_wall",
        "gallery/outside/scenes/van_der_pol_wall.toml",
        "d",
        lambda p: Oscillator(van_der_pol, [0.0], p["d"], p["r"]),
        None,
    ),
    Case(
        "relief_valve",
        "gallery/outside/scenes/relief_valve.toml",
        "seat",
        lambda p: Oscillator(
            valve, [p["kappa"], p["delta"], p["beta"], p["q"]], p["seat"], p["r"], side=-1
        ),
        None,
        sets=[
            "q=7.6",
            "model.parameters.seat=0",
            'model.surface.0.event="y1 - seat"',
            'grazing.solve_for="seat"',
            "grazing.guess={y1=0.05,y2=0,y3=47}",
        ],
    ),
]
