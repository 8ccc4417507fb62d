#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Flights in real time over a terrain that nginx serves, with a latency and a rate of the network. Run with the label long."""

import asyncio
import os
import sys
import threading
import time
import unittest

os.environ["no_proxy"] = "127.0.0.1"  # before the program's server starts
import nginx
from program import Folder, run_json

LATENCY, RATE = 0.1, 10e6  # seconds there and back; bytes a second


class Network:
    """Passes connections on, half the latency later each way, and at most RATE bytes a second in all from the server."""

    def __init__(self, port):
        self.target, self.free = port, 0.0
        self.loop = asyncio.new_event_loop()
        self.server = self.loop.run_until_complete(self.start())
        self.port = self.server.sockets[0].getsockname()[1]
        self.thread = threading.Thread(target=self.loop.run_forever, daemon=True)
        self.thread.start()

    async def start(self):
        return await asyncio.start_server(self.connect, "127.0.0.1", 0)

    async def connect(self, reader, writer):
        from_server, to_server = await asyncio.open_connection("127.0.0.1", self.target)
        await asyncio.gather(self.pass_on(reader, to_server, False), self.pass_on(from_server, writer, True))

    async def pass_on(self, reader, writer, is_limited):
        queue = asyncio.Queue()
        sender = asyncio.ensure_future(self.send(queue, writer))
        data = b"begin"
        while data:
            try:
                data = await reader.read(16384)
            except OSError:
                data = b""
            now = time.monotonic()
            if is_limited:
                self.free = max(self.free, now) + len(data) / RATE
                now = self.free
                await asyncio.sleep(max(0.0, now - time.monotonic() - 0.02))
            queue.put_nowait((now + LATENCY / 2, data))
        await sender

    async def send(self, queue, writer):
        data = b"begin"
        while data:
            due, data = await queue.get()
            await asyncio.sleep(max(0.0, due - time.monotonic()))
            if writer.transport.is_closing():
                continue
            try:
                writer.write(data)
                await writer.drain()
            except OSError:
                writer.close()
        writer.close()

    async def end(self):
        self.server.close()
        tasks = [task for task in asyncio.all_tasks() if task is not asyncio.current_task()]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        self.loop.stop()

    def stop(self):
        asyncio.run_coroutine_threadsafe(self.end(), self.loop)
        self.thread.join()


@unittest.skipUnless(nginx.NGINX, "nginx is not installed")
class Nginx(Folder):
    def setUp(self):
        super().setUp()
        raster = os.path.join(os.path.dirname(__file__), "../../../tools/data/jacksboro.tif")
        run_json("bake", "--dem", raster, "--seed", 7, "--detail-m", 5, "--out", self.path("store"), "--sharded")
        network = Network(nginx.serve(self))
        self.addCleanup(network.stop)
        self.address = f"http://127.0.0.1:{network.port}/store/"

    def fly(self, *terrain):
        return run_json("fly", *terrain, "--path", "straight", "--speed", 250, "--seconds", 20, "--fps", 30, "--threads", 4,
                        "--realtime", "--budget", 100_000)

    def test_no_frame_of_a_fast_flight_is_late(self):
        cache = ["--http-cache", self.path("cache")]
        local = self.fly("--dem", self.path("store"))
        cold = self.fly("--dem", self.address, *cache)
        warm = self.fly("--dem", self.address, *cache)
        for name, flight in (("local", local), ("cold", cold), ("warm", warm)):
            print(name, {key: flight.get(key) for key in ("late_frames", "not_resident_frames", "chunks_loaded", "http")})
            self.assertEqual((flight["late_frames"], flight["not_resident_frames"]), (0, 0), name)
            self.assertEqual(flight["error_px_max"], local["error_px_max"], name)
        self.assertGreater(cold["http"]["latency_s"], 0.9 * LATENCY)
        self.assertLess(cold["http"]["requests"], cold["chunks_loaded"])
        self.assertLess(warm["http"]["requests"], 5)


if __name__ == "__main__":
    result = unittest.main(argv=[sys.argv[0], *sys.argv[2:]], exit=False).result
    if result.testsRun == len(result.skipped):
        sys.exit(77)
    sys.exit(0 if result.wasSuccessful() else 1)
