#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The numbers of docs/scale.md: costs of large terrains, and clients of one server, on a virtual clock.

    python3 docs/figures/scale.py

Constants under "measured" are those of docs/store.md; those under "assumed" are a user's to replace.
"""
import math

import numpy as np

# Measured: docs/store.md
SCAN_SAMPLES_PER_S = 4e8 / 76  # processor seconds; one process
SCAN_BYTES_OF_DISK = 0.8  # a sample
SHARD_SAMPLES_PER_S = 4096.0**2 / 4.8  # processor seconds
STORE_BYTES = 1.22  # a sample, SRTM
CHUNKS_PER_S, REQUESTS_PER_CHUNK = 280 / 60, 126 / 280  # of a minute of flight at 250 m/s over HTTP
CHUNK_BYTES = 41.3e6 / 280  # likewise: in whole blocks, with siblings

# Assumed
ORIGIN_REQUESTS, ORIGIN_BYTES = 5500.0, 25e9 / 8  # a second: of object storage
EDGES = 20  # caches between clients and the origin, which keep all they have read
WORLD = 400e3  # side of the world, metres
SPEED = 250.0  # metres a second
FINEST_SIDE, LEVELS, REACH = 640.0, 10, 3  # of chunks: side, metres; levels; chunks of each level around a client
SECONDS = 600


def terrain_table():
    rows = (("Switzerland, 41,285 km2, at 0.5 m", 41285e6 / 0.25), ("land of the Earth, 149 million km2, at 30 m", 149e12 / 900),
            ("the same at 1 m", 149e12))
    for name, samples in rows:
        yield (name, f"{samples:.2g}", f"{samples / SCAN_SAMPLES_PER_S / 3600:,.0f} h, {samples * SCAN_BYTES_OF_DISK / 1e9:,.0f} GB",
               f"{samples / SHARD_SAMPLES_PER_S / 3600:,.0f} h", f"{samples * STORE_BYTES / 1e12:,.2f} TB",
               f"{samples / 4096**2 * 1.02:,.0f}")


def simulate(clients, edges):
    """Requests of clients that begin at 40 places of unequal frequency and fly straight on, and what the origin makes of them."""
    random = np.random.default_rng(7)
    places = random.uniform(0, WORLD, (40, 2))
    share = 1.0 / np.arange(1, 41)
    start = random.choice(40, clients, p=share / share.sum())
    at = places[start] + random.normal(0, 5e3, (clients, 2))
    angle = random.uniform(0, 2 * math.pi, clients)
    velocity = SPEED * np.column_stack((np.cos(angle), np.sin(angle)))
    edge = random.integers(0, max(edges, 1), clients)
    counts = [max(int(WORLD / (FINEST_SIDE * 2**level)), 1) for level in range(LEVELS)]
    kept = [np.zeros((max(edges, 1), n, n), bool) for n in counts]
    around = np.arange(-REACH, REACH + 1)
    backlog = worst = 0.0
    asked = missed = 0
    peak = 0.0
    for second in range(SECONDS):
        moved = at + velocity
        misses = 0
        for level, n in enumerate(counts):
            side = FINEST_SIDE * 2**level
            new, old = np.floor(moved / side).astype(int), np.floor(at / side).astype(int)
            wanted = []  # edge, column, row
            for axis in (0, 1):
                step = new[:, axis] - old[:, axis]
                those = np.flatnonzero(step)
                if not len(those):
                    continue
                front = new[those, axis] + REACH * np.sign(step[those])
                beside = new[those, 1 - axis][:, None] + around
                columns, rows = np.broadcast_arrays(front[:, None], beside)
                if axis == 1:
                    columns, rows = rows, columns
                wanted.append((np.repeat(edge[those], len(around)), columns.ravel() % n, rows.ravel() % n))
            for which, column, row in wanted:
                asked += len(which)
                if not edges:
                    misses += len(which)
                    continue
                index = (which * n + column) * n + row
                index = np.unique(index[~kept[level].ravel()[index]])
                kept[level].ravel()[index] = True
                misses += len(index)
        missed += misses
        requests = misses * REQUESTS_PER_CHUNK
        peak = max(peak, requests)
        served = min(ORIGIN_REQUESTS, ORIGIN_BYTES / (CHUNK_BYTES / REQUESTS_PER_CHUNK))
        backlog = max(backlog + requests - served, 0.0)
        worst = max(worst, backlog / served)
        at = moved
    rate = asked / SECONDS
    return (f"{clients:,}", f"{edges}", f"{rate:,.0f}", f"{rate * CHUNK_BYTES * 8 / 1e9:.1f}", f"{missed / SECONDS * REQUESTS_PER_CHUNK:,.0f}",
            f"{peak:,.0f}", f"{missed / SECONDS * CHUNK_BYTES * 8 / 1e9:.1f}", f"{worst:,.1f} s")


def main():
    print("| terrain | samples | scan: processor time, disk | shards: processor time | store | shards |\n|---|---|---|---|---|---|")
    for row in terrain_table():
        print("| " + " | ".join(row) + " |")
    print("\n| clients | caches | chunks/s | Gbit/s to clients | requests/s at the origin | most in a second | Gbit/s | longest wait |")
    print("|---|---|---|---|---|---|---|---|")
    for clients, edges in ((100, 0), (1000, 0), (10_000, 0), (100, EDGES), (1000, EDGES), (10_000, EDGES), (10_000, 1)):
        print("| " + " | ".join(simulate(clients, edges)) + " |")
    minute = 60 * CHUNKS_PER_S
    print(f"\na minute of flight: {minute:.0f} chunks, {minute * REQUESTS_PER_CHUNK:.0f} requests, {minute * CHUNK_BYTES / 1e6:.0f} MB; "
          f"without caches the origin's requests suffice for {ORIGIN_REQUESTS / CHUNKS_PER_S / REQUESTS_PER_CHUNK:,.0f} clients, "
          f"its bandwidth for {ORIGIN_BYTES / CHUNKS_PER_S / CHUNK_BYTES:,.0f}")


if __name__ == "__main__":
    main()
