"""Scores on the tables of gallery/benchmark."""

from __future__ import annotations

import csv
import importlib.util
import math
import tempfile
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Any

import numpy as np
from oscillators import Oscillator, beam, electrostatic, linear, spring
from programs import Leg, simulate

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from programs import Flyer, Watch

BENCHMARK = Path(__file__).parents[3] / "gallery/benchmark"


def checker() -> Any:
    """Load the checker of the benchmark."""
    spec = importlib.util.spec_from_file_location("check", BENCHMARK / "check.py")
    if spec is None or spec.loader is None:
        raise FileNotFoundError(BENCHMARK)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def table(name: str) -> list[dict[str, str]]:
    """Read a table of the benchmark."""
    with (BENCHMARK / name).open(newline="") as file:
        return list(csv.DictReader(file))


def rigid_problem(row: dict[str, str], offsets: dict[str, float]) -> tuple[Oscillator, float]:
    """Give the oscillator of a table at offsets, and the rate of its phase."""

    def value(name: str) -> float:
        return float(row[name + "_star"] or 0) + offsets.get("d" + name, 0.0)

    damping, restitution = float(row["zeta"]), float(row["r"])
    kind = row["problem"].split("_")[0]
    if kind == "cantilever":
        field = [damping, 0.7, value("beta")]
        return Oscillator(beam, field, value("Q"), restitution, side=-1), 1.0
    make, amplitude = (linear, "alpha") if kind == "linear" else (electrostatic, "V")
    field = [value(amplitude), value("omega"), 2 * damping, 1.0]
    return Oscillator(make, field, float(row["delta"]), restitution), value("omega")


def section_image(
    program: Flyer, o: Oscillator, rate: float, period: float, point: tuple[float, float]
) -> tuple[float, float]:
    """Give the next section point: its distance beyond the stop, and its phase less a period."""
    beyond, phase = point
    time = start = phase / rate
    duration = period / rate
    state = np.array([o.stop + o.side * beyond, 0.0])

    def fly(end: float, watch: Watch | None) -> tuple[float, Any, bool]:
        return program.fly(Leg(o.free, o.parameters, time, state, end, watch))

    if beyond > 0:
        time, state, _ = fly(time - duration / 2, (0, o.stop, 0))
        state = np.array([state[0], -o.restitution * state[1]])
    time, state, _ = fly(start + 0.9 * duration, None)
    time, state, found = fly(start + 1.1 * duration, (1, 0.0, -o.side))
    if not found:
        return math.nan, math.nan
    return o.side * (state[0] - o.stop), time * rate - period


def rigid_answers(
    program: Flyer, problem: dict[str, str], rows: list[dict[str, str]]
) -> Iterator[dict[str, Any]]:
    """Answer a table of section points."""
    star = float(problem["theta_star"])
    period = math.pi if problem["problem"].startswith("mems") else math.tau
    point = (math.nan, math.nan)
    for row in rows:
        offsets = {name: float(row[name]) for name in row if name.startswith("d")}
        oscillator, rate = rigid_problem(problem, offsets)
        if row["iteration"] == "1":
            point = (float(row["x_minus_delta"]), star + offsets["dtheta"])
        point = section_image(program, oscillator, rate, period, point)
        yield {**row, "result.x_minus_delta": point[0], "result.dtheta": point[1] - star}


def soft_answers(
    program: Flyer, problem: dict[str, str], rows: list[dict[str, str]]
) -> Iterator[dict[str, Any]]:
    """Answer a table of stroboscopic images of a compliant stop."""
    k2, r2, d, rate = (float(problem[name]) for name in ("k2", "R2", "d", "omega"))
    star, phase, duration = (float(problem[name]) for name in ("A_star", "phase", "period"))
    for row in rows:
        p = [star + float(row["dA"]), rate, 0.03, 1.0, k2, r2, d, 1.0]
        o = Oscillator(linear, p, 1.0, contact=spring)
        s = np.array([-1.0 + float(row["du"]), float(row["dv"])])
        time = phase / rate
        flight = simulate(program, o, time, s, time + duration)
        yield {
            **row,
            "result.u1": flight.state[0],
            "result.v1": flight.state[1],
            "result.n_contacts": flight.contacts,
        }


def tables() -> dict[str, Any]:
    """Give the tables of one mass, each with what answers it and its constants."""
    rigid = {row["problem"]: (rigid_answers, row) for row in table("problems/rigid.csv")}
    # The contact of law B ends where its force is zero, which no watched component tells.
    soft = {
        "soft_" + row["set"]: (soft_answers, row)
        for row in table("problems/soft.csv")
        if row["law"] != "B"
    }
    return {**rigid, **soft}


def score(name: str, programs: Sequence[Flyer]) -> list[Any]:
    """Score programs on a table: the least and the median number of correct digits."""
    check, file, (answer, problem) = checker(), f"images/{name}.csv", tables()[name]
    rows, cells = table(file), []
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "answers.csv"
        for program in programs:
            with path.open("w", newline="") as out:
                writer = csv.DictWriter(out, rows[0].keys())
                writer.writeheader()
                for row in answer(program, problem, rows):
                    exact = {k: repr(float(v)) for k, v in row.items() if k.startswith("result.")}
                    writer.writerow({**row, **exact})
            _, digits, faults, total = check.compare(BENCHMARK / file, path)
            missing = f" ({len(faults)} of {total} not found)" if faults else ""
            cells.append(f"{digits[0]:.1f}, {median(digits):.1f}{missing}")
    return [f"`{name}`", len(rows), *cells]
