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

    import numpy as np

distributed: Any = pytest.importorskip("distributed")


@pytest.fixture(scope="module")
def client() -> Iterator[Any]:
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=":0"
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        yield client


@pytest.fixture(scope="module")
def m() -> gm.Map:
    return gm.Scene.catalogue("linear").graze().map()


def chart(m: gm.Map, client: Any = None) -> gm.Chart:
    plane, ranges = ("omega", "alpha"), ((-1e-4, 1e-4), (-2e-5, 2e-5))
    return gm.chart(m, plane, ranges, points=(60, 40), transient=200, method="map", client=client)


def same_bits(ours: np.ndarray[Any, Any], expected: np.ndarray[Any, Any]) -> bool:
    return ours.tobytes() == expected.tobytes()


def assert_same(ours: gm.Table, expected: gm.Table) -> None:
    assert ours.document == expected.document
    assert list(ours) == list(expected)
    for name, column in expected.items():
        is_text = column.dtype == object
        assert list(ours[name]) == list(column) if is_text else same_bits(ours[name], column), name


def test_numbers_of_a_cluster_are_those_of_one_process(m: gm.Map, client: Any) -> None:
    assert_same(chart(m, client), chart(m))
    sweep = ("alpha", (-2e-5, 2e-5))
    assert_same(
        gm.diagram(m, *sweep, points=60, method="map", client=client),
        gm.diagram(m, *sweep, points=60, method="map"),
    )
    at = {"alpha": 1e-5}
    assert_same(
        gm.basin(m, points=30, at=at, method="map", client=client),
        gm.basin(m, points=30, at=at, method="map"),
    )
    along, which = ("alpha", (-1e-5, 1e-5)), ["1", "10", "100"]
    ours = gm.branch(m, *along, itineraries=which, client=client)
    assert_same(ours, gm.branch(m, *along, itineraries=which))


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
