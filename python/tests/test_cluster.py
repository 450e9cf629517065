"""Computations on a cluster: equal to local ones, also where a worker dies."""

from __future__ import annotations

import os
import signal
import threading
import time
from typing import TYPE_CHECKING, Any

import pytest

import grazemap as gm

if TYPE_CHECKING:
    from collections.abc import Iterator

pytest.importorskip("distributed")


@pytest.fixture(scope="module")
def client() -> Iterator[Any]:
    import distributed

    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        yield client


@pytest.fixture(scope="module")
def m() -> gm.Map:
    return gm.Scene.catalogue("linear").graze().map()


def chart(m: gm.Map, client: Any = None) -> gm.Chart:
    return gm.chart(
        m, ("omega", "alpha"), ((-1e-3, 1e-3), (-1e-4, 3e-4)), points=(90, 60), client=client
    )


def assert_same(ours: gm.Table, expected: gm.Table) -> None:
    assert ours.document == expected.document
    assert list(ours) == list(expected)
    for name, column in expected.items():
        assert ours[name].tolist() == pytest.approx(column.tolist(), rel=0, abs=0, nan_ok=True)


def test_numbers_of_a_cluster_are_those_of_one_process(m: gm.Map, client: Any) -> None:
    assert_same(chart(m, client), chart(m))
    sweep = ("alpha", (-1e-4, 3e-4))
    assert_same(gm.diagram(m, *sweep, points=100, client=client), gm.diagram(m, *sweep, points=100))
    at = {"alpha": 1e-4}
    assert_same(gm.basin(m, points=60, at=at, client=client), gm.basin(m, points=60, at=at))


def test_shares_of_a_worker_that_dies_are_computed_again(m: gm.Map, client: Any) -> None:
    workers = client.run(os.getpid)
    killed = threading.Event()

    def kill() -> None:
        # As soon as a worker has finished a share, the other one has begun one.
        while not any(client.has_what().values()):
            time.sleep(0.001)
        os.kill(next(iter(workers.values())), signal.SIGKILL)
        killed.set()

    threading.Thread(target=kill, daemon=True).start()
    assert_same(chart(m, client), chart(m))
    assert killed.is_set()
    assert set(client.run(os.getpid).values()) != set(workers.values())
