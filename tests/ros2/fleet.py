"""Nodes of Cyclone DDS that start at the same time, each in a process of its own, as robots have them."""

import multiprocessing
import time
import typing
from concurrent.futures import ProcessPoolExecutor

import dds_types as dds
from nodes import DOMAIN, Node
from processes import DEADLINE_S


class Start(typing.NamedTuple):
    """What a node got in its first moments, and after how many milliseconds."""
    grid: dds.OccupancyGrid
    map_ms: float
    names: list  # one of each reply
    slowest_reply_ms: float


def milliseconds_since(begin):
    return 1000 * (time.monotonic() - begin)


def start_nodes(count, layer, place, calls):
    """Starts nodes that get /map and then call get_string_at_point. Returns a Start of each."""
    # Forks a process that has the modules, but not the threads of this one.
    processes = multiprocessing.get_context("forkserver")
    processes.set_forkserver_preload([__name__])
    with processes.Manager() as manager, ProcessPoolExecutor(count, processes) as pool:
        everybody = manager.Barrier(count)
        starts = [pool.submit(_start_node, DOMAIN, everybody, layer, place, calls)
                  for _ in range(count)]
        return [start.result() for start in starts]


def _start_node(domain, everybody, layer, place, calls):
    everybody.wait(DEADLINE_S)
    begin = time.monotonic()
    node = Node(domain)
    grid = node.subscribe("/map", dds.OccupancyGrid).next()
    map_ms = milliseconds_since(begin)
    client = node.client("/hypermap/get_string_at_point")
    client.await_service()
    names, times_ms = [], []
    for _ in range(calls):
        begin = time.monotonic()
        names.append(client.call(layer, place).name)
        times_ms.append(milliseconds_since(begin))
    return Start(grid, map_ms, names, max(times_ms))
