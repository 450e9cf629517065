"""Other programs on the problems of the benches, beside the benches' own figures of the same machine.

`benches/peers/run` installs them, runs `cargo bench`, and then this file, which reads what criterion wrote. Every figure
is a median of wall times on one thread; take the ratios.
"""

import json
import math
import statistics
import sys
import time
from pathlib import Path

import heyoka as hy
import numpy as np
from scipy.integrate import solve_ivp

DELTA, ZETA, RESTITUTION, OMEGA = 1.0, 0.05, 0.8, 1.8
ALPHA = 2.247220505424423 * 1.002
PERIOD = 2 * math.pi / OMEGA


def median_seconds(work, runs):
    """Median time of a call, after one that is not counted."""
    work()
    times = []
    for _ in range(runs):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def ours(criterion, name):
    """Median of one bench in seconds, by the folder that criterion writes; None if it has not run."""
    file = criterion / name / "new" / "estimates.json"
    if not file.exists():
        return None
    return json.loads(file.read_text())["median"]["point_estimate"] * 1e-9


def actuator(order):
    """Jets of one period of x' = v, v' = V² sin²θ/(1 − x)² − 0.04 v − x, θ' = ω in (x, v, θ, V, ω)."""
    x, v, theta = hy.make_vars("x", "v", "theta")
    voltage, omega = hy.par[0], hy.par[1]
    pull = (voltage * hy.sin(theta) / (1.0 - x)) ** 2
    system = [(x, v), (v, pull - 0.04 * v - x), (theta, omega)]
    wanted = hy.var_args.vars | hy.var_args.params
    extended = hy.var_ode_sys(system, wanted, order=order)
    start = time.perf_counter()
    integrator = hy.taylor_adaptive(
        extended, [0.3, 0.1, 0.4], pars=[0.2, 0.6], compact_mode=True, tol=1e-15
    )
    compiled = time.perf_counter() - start
    initial = integrator.state.copy()

    def period():
        integrator.time = 0.0
        integrator.state[:] = initial
        integrator.propagate_until(math.pi / 0.6)

    return median_seconds(period, 30), compiled


def impacting_with_heyoka(periods=2000):
    """Seconds per forcing period of the linear oscillator with its stop, by a terminal event."""
    x, v, theta = hy.make_vars("x", "v", "theta")
    force = ALPHA * hy.cos(theta)
    system = [(x, v), (v, force - 2 * ZETA * v - x), (theta, OMEGA + 0.0 * x)]

    class Impact:
        def __call__(self, integrator, _):
            integrator.state[1] *= -RESTITUTION
            return True

    event = hy.t_event(DELTA - x, direction=hy.event_direction.negative, callback=Impact())
    integrator = hy.taylor_adaptive(system, [0.1, 0.0, 0.0], t_events=[event], tol=1e-15)

    def stretch():
        integrator.time = 0.0
        integrator.state[2] %= 2 * math.pi
        integrator.propagate_until(periods * PERIOD)

    return median_seconds(stretch, 5) / periods


def impacting_with_scipy(periods=40):
    """The same with SciPy's DOP853 and a terminal event."""

    def field(_, y):
        return [y[1], ALPHA * math.cos(y[2]) - 2 * ZETA * y[1] - y[0], OMEGA]

    def gap(_, y):
        return DELTA - y[0]

    gap.terminal, gap.direction = True, -1

    def stretch():
        y, t, end = np.array([0.1, 0.0, 0.0]), 0.0, periods * PERIOD
        while t < end:
            found = solve_ivp(field, (t, end), y, "DOP853", events=gap, rtol=1e-12, atol=1e-12)
            t, y = found.t[-1], found.y[:, -1].copy()
            if found.status == 1:
                y[1] *= -RESTITUTION

    return median_seconds(stretch, 3) / periods


def row(work, peer, theirs, mine):
    mine_text = "-" if mine is None else f"{mine * 1e6:.3g}"
    ratio = "-" if mine is None else f"{theirs / mine:.3g}"
    print(f"| {work} | {peer} | {theirs * 1e6:.3g} | {mine_text} | {ratio} |", flush=True)


def main():
    criterion = Path(sys.argv[1])
    orders = int(sys.argv[2]) if len(sys.argv) > 2 else 4
    print("| work | peer | peer, us | grazemap, us | peer / grazemap |\n|---|---|---|---|---|")
    for order in range(1, orders + 1):
        seconds, compiled = actuator(order)
        peer = f"heyoka {hy.__version__}, compact, compiled in {compiled:.1f} s"
        row(f"jets of the actuator's period, order {order}", peer, seconds, ours(criterion, f"jets_collocation_{order}"))
    mine = ours(criterion, "simulation_period_linear_f64")
    work = "a forcing period of the linear oscillator with impacts"
    row(work, f"heyoka {hy.__version__}, terminal event", impacting_with_heyoka(), mine)
    row(work, "SciPy DOP853, terminal event", impacting_with_scipy(), mine)


if __name__ == "__main__":
    main()
