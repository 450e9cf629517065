"""Flights past a graze: missed contacts, errors of returns and of their derivatives."""

from __future__ import annotations

import csv
import io
import json
import subprocess
from collections import Counter
from dataclasses import dataclass, field
from decimal import Decimal, getcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from oscillators import CASES, Case, Oscillator
from programs import Flyer, Heyoka, Leg, fixed_times, simulate

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

ROOT = Path(__file__).parents[3]
STARTS = 4  # of each system
DEPTHS = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-8, 1e-10, 1e-12)
DERIVATIVE_DEPTHS = (1e-2, 1e-4, 1e-6, 1e-8)
FIXED = "times fixed"
STEPS = (("difference", "1e-6"), ("scaled", "depth/100"))
getcontext().prec = 60


class Grazemap:
    """The program, as a source of truth."""

    def __init__(self, program: str) -> None:
        """Take the path of the program."""
        self.program = program

    def version(self) -> str:
        """Give the name and version of the program."""
        words = [self.program, "--version"]
        return subprocess.run(words, check=True, capture_output=True, text=True).stdout.strip()

    def ask(
        self, command: str, case: Case, *options: str, sets: Sequence[str] = (), text: str = ""
    ) -> str:
        """Run a command on the scene of a case, its stop active."""
        active = [*case.sets, f'expansion.active=["{case.stop}"]', *sets]
        given = [word for one in active for word in ("--set", one)]
        words = [self.program, command, str(ROOT / case.scene), "-q", *given, *options]
        return subprocess.run(words, check=True, capture_output=True, text=True, input=text).stdout


@dataclass
class Start:
    """A start of a flight that would pass its graze at an extreme, were there no stop."""

    oscillator: Oscillator
    time: float
    state: Any
    end: float
    extreme: float
    sets: list[str]
    """Keys of the section at whose phase the flight begins and ends."""
    point: Any
    """State of the grazing orbit there."""

    def at_depth(self, depth: float) -> Oscillator:
        """Place the stop so that the flight would go beyond it by a depth."""
        return self.oscillator.at(self.extreme - self.oscillator.side * depth)


def extremes(program: Heyoka, o: Oscillator, time: float, state: Any, end: float) -> list[float]:
    """Give the turns of a free flight towards the stop, the farthest first."""
    found: list[float] = []
    step = (end - time) / 1000
    turn = (1, 0.0, -o.side)
    while True:
        time, state, hit = program.fly(Leg(o.free, o.parameters, time, state, end, turn))
        if not hit:
            return sorted(found, key=lambda x: -o.side * x)
        found.append(state[0])
        behind = min(time + step, end)
        time, state, _ = program.fly(Leg(o.free, o.parameters, time, state, behind))


def starts(grazemap: Grazemap, case: Case, rng: Any) -> Iterator[Start]:
    """Give starts a part of a period before the graze, near its orbit."""
    orbit = json.loads(grazemap.ask("locate", case, "--json", "-"))
    o = case.oscillator(orbit["parameters"])
    n = len(orbit["state"]) - (case.rate is not None)
    at_graze, free = np.array(list(orbit["state"].values())[:n]), Heyoka()
    duration = orbit["period"]
    for share in (0.25, 0.4, 0.6, 0.75):
        sets = []
        if case.rate is None:
            time = (1 - share) * duration
            point = free.fly(Leg(o.free, o.parameters, 0.0, at_graze, time))[1]
        else:
            rate = orbit["parameters"][case.rate] if isinstance(case.rate, str) else case.rate
            phase = orbit["state"]["theta"] - share * case.period
            sets = ['section.kind="stroboscopic"', f"section.phase={phase!r}"]
            time = phase / rate
            section = json.loads(grazemap.ask("locate", case, "--json", "-", sets=sets))["section"]
            point = np.array(section["point"])
        kept = 0
        while kept < STARTS // 4:
            # NOTE: offsets of few binary digits, so that their sums with a step are exact.
            offset = np.round(rng.uniform(-0.03, 0.03, n) * 2**20) / 2**20
            state, end = point + offset, time + duration
            turns = extremes(free, o, time, state, end)
            margin = 2 * DEPTHS[0]
            clear = turns and o.side * (turns[0] - state[0]) > margin
            if clear and all(o.side * (turns[0] - other) > margin for other in turns[1:]):
                kept += 1
                yield Start(o, time, state, end, float(turns[0]), sets, point)


@dataclass
class Truth:
    """The state at the end of a flight, and its derivatives by the state at the start."""

    state: Any
    contacts: int
    matrix: Any


def stroboscopic_truth(
    grazemap: Grazemap, case: Case, group: list[Start], precision: str
) -> list[list[Truth]]:
    """Take images of a section, for every start and depth; derivatives by central differences."""
    orbit = json.loads(grazemap.ask("locate", case, "--json", "-", sets=group[0].sets))
    names, nominal = orbit["section"]["coordinates"], orbit["parameters"][case.stop]
    text, n = io.StringIO(), len(names)
    text.write(",".join([*names, case.stop]) + "\n")
    for start in group:
        for depth in DEPTHS:
            stop = Decimal(start.at_depth(depth).stop) - Decimal(nominal)
            step = Decimal(depth) * Decimal("1e-10")
            offsets = [
                Decimal(a) - Decimal(b) for a, b in zip(start.state, start.point, strict=True)
            ]
            for moved in range(-1, 2 * n):
                own = list(offsets)
                if moved >= 0:
                    own[moved // 2] += step if moved % 2 == 0 else -step
                text.write(",".join(f"{x:.45e}" for x in [*own, stop]) + "\n")
    options = ("--states", "-", "--method", "direct", "--precision", precision, "--csv", "-")
    answer = grazemap.ask("image", case, *options, sets=group[0].sets, text=text.getvalue())
    rows = list(csv.DictReader(io.StringIO(answer)))
    images = [[Decimal(row[name] or "nan") for name in names] for row in rows]
    truths, width = [], 2 * n + 1
    for s, start in enumerate(group):
        own = []
        for d, depth in enumerate(DEPTHS):
            at = (s * len(DEPTHS) + d) * width
            state = [float(Decimal(a) + b) for a, b in zip(start.point, images[at], strict=True)]
            step = Decimal(depth) * Decimal("2e-10")
            matrix = np.empty((n, n))
            for j in range(n):
                up, down = images[at + 1 + 2 * j], images[at + 2 + 2 * j]
                matrix[:, j] = [float((a - b) / step) for a, b in zip(up, down, strict=True)]
            contacts = int(rows[at]["contacts"] or 0) + int(rows[at]["extra_contacts"] or 0)
            own.append(Truth(np.array(state), contacts, matrix))
        truths.append(own)
    return truths


def autonomous_truth(grazemap: Grazemap, case: Case, start: Start, depth: float) -> Truth:
    """Take the state after a time with its derivatives, in double precision."""
    stop = f"model.parameters.{case.stop}={start.at_depth(depth).stop!r}"
    names = ["x", "v"] if len(start.state) == 2 else ["y1", "y2", "y3"]
    at = ",".join(f"{name}={x!r}" for name, x in zip(names, map(float, start.state), strict=True))
    options = ("--start", at, "--time", repr(start.end - start.time), "--json", "-")
    answer = json.loads(grazemap.ask("derivatives", case, *options, sets=[stop]))
    n = len(names)
    matrix = np.array([answer["derivatives"][name]["gradient"][:n] for name in names])
    state = np.array([answer["state"][name] for name in names])
    return Truth(state, len(answer["events"]), matrix)


@dataclass
class Aim:
    """A start with the stop at a depth, and what is true there."""

    start: Start
    depth: float
    truth: Truth
    double: Truth | None
    """Direct simulation in double precision, where the truth is in double-double."""


def differences(program: Flyer, start: Start, o: Oscillator, step: float) -> Any:
    """Give derivatives by central differences."""
    n = len(start.state)
    matrix = np.empty((n, n))
    for j in range(n):
        ends = []
        for way in (step, -step):
            moved = start.state.copy()
            moved[j] += way
            ends.append(simulate(program, o, start.time, moved, start.end).state)
        matrix[:, j] = (ends[0] - ends[1]) / (2 * step)
    return matrix


@dataclass
class Flights:
    """What the programs made of the flights of a case, by depth and program."""

    missed: Counter[tuple[float, str]] = field(default_factory=Counter)
    returns: dict[tuple[float, str], list[float]] = field(default_factory=dict)
    derivatives: dict[tuple[float, str], list[float]] = field(default_factory=dict)

    def compare_returns(self, aim: Aim, programs: Sequence[Flyer]) -> None:
        """Fly by all programs; count what misses the contact, and errors of the others."""
        start, o = aim.start, aim.start.at_depth(aim.depth)
        answers: dict[str, Any] = {
            p.name: simulate(p, o, start.time, start.state, start.end) for p in programs
        }
        if aim.double is not None:
            answers["Grazemap"] = aim.double
        size = np.abs(aim.truth.state).max()
        for name, answer in answers.items():
            self.missed[aim.depth, name] += answer.contacts == 0
            if answer.contacts > 0:
                error = np.abs(answer.state - aim.truth.state).max() / size
                self.returns.setdefault((aim.depth, name), []).append(float(error))

    def compare_derivatives(self, aim: Aim, programs: Sequence[Flyer]) -> None:
        """Take derivatives by differences, and by variations with the times of events fixed."""
        start, o = aim.start, aim.start.at_depth(aim.depth)
        answers = {
            f"{p.name}; {words}": differences(p, start, o, step)
            for p in programs
            for words, step in ((STEPS[0][1], 1e-6), (STEPS[1][1], aim.depth / 100))
        }
        heyoka = next(program for program in programs if isinstance(program, Heyoka))
        flight = simulate(heyoka, o, start.time, start.state, start.end)
        answers[FIXED] = fixed_times(heyoka, o, flight)
        norm = np.linalg.norm(aim.truth.matrix)
        for name, matrix in answers.items():
            error = np.linalg.norm(matrix - aim.truth.matrix) / norm
            self.derivatives.setdefault((aim.depth, name), []).append(float(error))


def aims(grazemap: Grazemap, case: Case) -> Iterator[Aim]:
    """Give all starts of a case at all depths."""
    rng = np.random.default_rng(CASES.index(case))
    all_starts = list(starts(grazemap, case, rng))
    for first in range(0, STARTS, STARTS // 4):
        group = all_starts[first : first + STARTS // 4]
        if case.rate is None:
            truths = [[autonomous_truth(grazemap, case, s, d) for d in DEPTHS] for s in group]
            doubles = [[None for _ in DEPTHS] for _ in group]
        else:
            truths = stroboscopic_truth(grazemap, case, group, "dd")
            doubles = stroboscopic_truth(grazemap, case, group, "f64")
        for start, own, double in zip(group, truths, doubles, strict=True):
            for depth, truth, other in zip(DEPTHS, own, double, strict=True):
                if truth.contacts == 0:
                    raise NoContactError(case.name, depth)
                yield Aim(start, depth, truth, other)


class NoContactError(Exception):
    """A flight that should hit does not: the stop is not where it was meant to be."""


def fly_case(
    grazemap: Grazemap, case: Case, programs: Sequence[Flyer], differentiated: Sequence[Flyer]
) -> Flights:
    """Fly all starts of a case at all depths."""
    flights = Flights()
    for aim in aims(grazemap, case):
        flights.compare_returns(aim, programs)
        if aim.depth in DERIVATIVE_DEPTHS:
            flights.compare_derivatives(aim, differentiated)
    return flights
