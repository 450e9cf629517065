"""Score other programs near a graze; rewrite the tables of docs/studies/peers.md.

python benches/peers/near_graze GRAZEMAP    GRAZEMAP is the program `grazemap`
python benches/peers/near_graze GRAZEMAP soft_A1 images/soft_A1    this system and table alone

`benches/peers/near_graze/run` installs what it needs first. Truth is the program's direct simulation in double-double, the
reference tables of gallery/benchmark, and, of autonomous systems, `grazemap derivatives`.
"""

from __future__ import annotations

import sys
from importlib.metadata import version
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Any

from flights import DEPTHS, DERIVATIVE_DEPTHS, FIXED, STEPS, Flights, Grazemap, fly_case
from oscillators import CASES
from programs import Heyoka, Numba, SciPy
from tables import score, tables

if TYPE_CHECKING:
    from collections.abc import Sequence

PAGE = Path(__file__).parents[3] / "docs/studies/peers.md"


def markdown(head: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """Write a table."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(map(str, line)) + " |" for line in lines)


def spread(errors: Sequence[float]) -> str:
    """Write the median and the largest of some errors."""
    return f"{median(errors):.0e}, {max(errors):.0e}" if errors else "none"


def rewrite(marker: str, text: str) -> None:
    """Put a table between its marker and the next end."""
    page = PAGE.read_text()
    before, rest = page.split(f"<!-- {marker} -->\n", 1)
    _, after = rest.split("<!-- end -->", 1)
    PAGE.write_text(f"{before}<!-- {marker} -->\n{text}\n\n<!-- end -->{after}")


PROGRAMS = (
    SciPy(1e-8, 1e-10),
    SciPy(1e-13, 1e-14),
    Numba(1e-13, 1e-14, 1),
    Numba(1e-13, 1e-14, 8),
    Heyoka(),
)
DIFFERENTIATED = (PROGRAMS[1], PROGRAMS[4])


def write(grazemap: Grazemap, flights: dict[str, Flights], scores: list[list[Any]]) -> None:
    """Rewrite the tables of the page."""
    names = [program.name for program in PROGRAMS]
    settings = [(program.name, program.settings) for program in PROGRAMS]
    rewrite("settings", markdown(["program", "settings"], settings))
    used = [f"{name} {version(name)}" for name in ("scipy", "numba", "heyoka", "numpy")]
    rewrite(
        "versions", ", ".join([*used, grazemap.version(), f"Python {sys.version.split()[0]}"]) + "."
    )
    columns = [*names, "Grazemap"]
    rows: list[list[Any]] = [
        [f"{d:.0e}", *(sum(f.missed[d, name] for f in flights.values()) for name in columns)]
        for d in DEPTHS
    ]
    rewrite("missed", markdown(["depth", *columns], rows))
    rows = [
        [f"`{case}`", *(sum(f.missed[d, name] for d in DEPTHS) for name in columns)]
        for case, f in flights.items()
    ]
    rewrite("systems", markdown(["system", *columns], rows))

    def together(what: str, depth: float, name: str) -> str:
        return spread(
            [x for f in flights.values() for x in getattr(f, what).get((depth, name), [])]
        )

    rows = [[f"{d:.0e}", *(together("returns", d, name) for name in columns)] for d in DEPTHS]
    rewrite("returns", markdown(["depth", *columns], rows))
    for marker, step in STEPS:
        columns = [*(f"{program.name}; {step}" for program in DIFFERENTIATED), FIXED]
        rows = [
            [f"{d:.0e}", *(together("derivatives", d, name) for name in columns)]
            for d in DERIVATIVE_DEPTHS
        ]
        head = ["depth", *(program.name for program in DIFFERENTIATED), FIXED]
        rewrite(marker, markdown(head, rows))
    rewrite("benchmark", markdown(["table", "rows", *names], scores))


def main(program: str, *names: str) -> None:
    """Measure all systems and tables, or those that are named, and write the page."""
    grazemap = Grazemap(program)
    flights = {
        case.name: fly_case(grazemap, case, PROGRAMS, DIFFERENTIATED)
        for case in CASES
        if not names or case.name in names
    }
    asked = [name for name in tables() if not names or f"images/{name}" in names]
    write(grazemap, flights, [score(name, PROGRAMS) for name in asked])


if __name__ == "__main__":
    main(*sys.argv[1:])
