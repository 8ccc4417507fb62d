#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Flights over a terrain that nginx serves: with HTTP/2, and in real time with a latency and a rate of the network, which have the label long."""

import asyncio
import json
import os
import shutil
import subprocess
import sys
import threading
import time
import unittest

os.environ["no_proxy"] = "127.0.0.1"  # before the program's server starts
import nginx
from program import PROGRAM, Folder, ask, run_json

RASTER = os.path.join(os.path.dirname(__file__), "../../../tools/data/jacksboro.tif")
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
        run_json("bake", "--dem", RASTER, "--seed", 7, "--detail-m", 5, "--out", self.path("store"), "--sharded")
        network = Network(nginx.serve(self))
        self.addCleanup(network.stop)
        self.address = f"http://127.0.0.1:{network.port}/store/"

    def fly(self, *terrain):
        # A budget that no frame uses up: one that did would not count as late.
        return run_json("fly", *terrain, "--path", "straight", "--speed", 250, "--seconds", 60, "--fps", 30, "--threads", 4,
                        "--realtime", "--max-error-px", 2, "--budget", 1_000_000)

    def test_no_frame_of_a_minute_of_fast_flight_is_late(self):
        cache = ["--http-cache", self.path("cache")]
        local = self.fly("--dem", self.path("store"))
        cold = self.fly("--dem", self.address, *cache)
        warm = self.fly("--dem", self.address, *cache)
        for name, flight in (("local", local), ("cold", cold), ("warm", warm)):
            print(name, {key: flight.get(key) for key in ("late_frames", "not_resident_frames", "chunks_loaded", "http")})
            self.assertEqual((flight["late_frames"], flight["not_resident_frames"]), (0, 0), name)
            self.assertEqual(flight["error_px_max"], local["error_px_max"], name)
        self.assertGreater(cold["http"]["latency_s"], 0.9 * LATENCY)
        # with those that read the heights along the path
        self.assertLess(cold["http"]["requests"], 0.5 * cold["chunks_loaded"])
        self.assertLess(warm["http"]["requests"], 5)

    def test_ground_under_a_wheel_comes_after_a_few_round_trips(self):
        begin = time.monotonic()
        question = [{"op": "height", "x": 1234.5, "y": -321.0}]
        over = ask(["--dem", self.address, "--http-cache", "off"], question)
        seconds = time.monotonic() - begin
        print(f"first ground after {seconds:.2f} s, the program's start included")
        self.assertEqual(over, ask(["--dem", self.path("store")], question))


@unittest.skipUnless(nginx.NGINX and shutil.which("openssl"), "nginx or openssl is not installed")
class Http2(Folder):
    FLIGHT = ["--path", "straight", "--seconds", 1, "--fps", 10, "--threads", 4, "--budget", 20_000, "--size", "160x90"]

    def setUp(self):
        super().setUp()
        _, raster = self.hills(300, 200)
        run_json("bake", "--dem", raster, "--seed", 7, "--detail-m", 4, "--out", self.path("store"), "--sharded")
        subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-days", "2",
                        "-subj", "/CN=localhost", "-addext", "subjectAltName=DNS:localhost", "-keyout", self.path("key.pem"),
                        "-out", self.path("certificate.pem")], check=True, capture_output=True)

    def fly(self, name, terrain):
        """The meshes of a flight, and what the program says of its requests."""
        words = [PROGRAM, "fly", "--dem", terrain, *map(str, self.FLIGHT), "--http-cache", "off", "--out", self.path(name), "--json"]
        trust = {"CURL_CA_BUNDLE": self.path("certificate.pem"), "no_proxy": "localhost"}
        done = subprocess.run(words, env=os.environ | trust, capture_output=True, text=True, timeout=120)
        self.assertEqual(done.returncode, 0, done.stderr)
        meshes = [[row[key] for key in ("eye_x_m", "eye_y_m", "triangles", "error_px")] for row in self.rows(f"{name}/frames.csv")]
        return meshes, json.loads(done.stdout).get("http")

    def fly_over(self, options):
        """The same over a server; the protocols and the number of the connections of its requests."""
        port = nginx.serve(self, f"{options}; ssl_certificate {self.path('certificate.pem')}; ssl_certificate_key {self.path('key.pem')}")
        meshes, http = self.fly("over", f"https://localhost:{port}/store/")
        log = [line.split() for line in self.read(f"access{port}.log").decode().splitlines()]
        self.assertEqual(http["failures"], {})
        self.assertGreater(len(log), http["requests"] / 2)  # the server logs a request after its last byte
        return meshes, {protocol for protocol, _ in log}, len({connection for _, connection in log}), len(log)

    def test_requests_share_a_connection(self):
        meshes, _ = self.fly("folder", self.path("store"))
        # Requests at the same time need several connections without HTTP/2.
        over, protocols, connections, _ = self.fly_over("ssl")
        self.assertEqual((over, protocols), (meshes, {"HTTP/1.1"}))
        self.assertGreater(connections, 1)
        over, protocols, connections, _ = self.fly_over("ssl http2")
        self.assertEqual((over, protocols, connections), (meshes, {"HTTP/2.0"}, 1))
        # The server closes each connection after a few requests.
        over, protocols, connections, requests = self.fly_over("ssl http2; keepalive_requests 5")
        self.assertEqual((over, protocols), (meshes, {"HTTP/2.0"}))
        self.assertGreaterEqual(connections, requests / 5)


if __name__ == "__main__":
    result = unittest.main(argv=[sys.argv[0], *sys.argv[2:]], exit=False).result
    if result.testsRun == len(result.skipped):
        sys.exit(77)
    sys.exit(0 if result.wasSuccessful() else 1)
