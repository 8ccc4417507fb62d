#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Baked terrains on an HTTP server, which this script is."""

import csv
import hashlib
import hmac
import http.server
import json
import os
import random
import re
import shutil
import subprocess
import sys
import threading
import time

os.environ["no_proxy"] = "127.0.0.1"  # before the program's server starts
from program import PROGRAM, SEED, Folder, ask, main, run, run_json, start

FLIGHT = ["--path", "straight", "--seconds", 1, "--fps", 10, "--threads", 0, "--budget", 20_000, "--size", "160x90"]


class Handler(http.server.BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"

    def do_GET(self):
        server = self.server
        path = os.path.join(server.folder, os.path.basename(self.path.split("?")[0]))
        server.requests.append((self.path, self.headers["Range"], self.headers["Authorization"]))
        if server.keys and self.headers["Authorization"] != signature(self.path, self.headers, *server.keys):
            self.send_error(403)
            return
        if server.faults:
            self.send_response(server.faults.pop())
            self.send_header("Content-Length", "0")
            self.end_headers()
            return
        if not os.path.isfile(path):
            self.send_error(404)
            return
        with open(path, "rb") as file:
            content = file.read()
        wanted = re.match(r"bytes=(\d+)-(\d+)$", self.headers["Range"] or "")
        if wanted:
            first, last = map(int, wanted.groups())
            self.send_response(206)
            self.send_header("Content-Range", f"bytes {first}-{last}/{len(content)}")
            content = content[first:last + 1]
        else:
            self.send_response(200)
        self.send_header("Content-Length", str(len(content)))
        self.end_headers()
        self.wfile.write(content)

    def log_message(self, *_):
        pass


def signature(path, headers, access_key, secret_key, region):
    """The header Authorization of a GET without a body: AWS Signature Version 4, of every header that the request names as signed and all of Amazon's."""
    names = re.search(r"SignedHeaders=([^,]+)", headers["Authorization"] or "")
    signed = sorted({name.lower() for name in headers if name.lower().startswith("x-amz-")} | {"host"} |
                    set(names[1].split(";") if names else ()))
    lines = "".join(f"{name}:{' '.join((headers[name] or '').split())}\n" for name in signed)
    body = hashlib.sha256(b"").hexdigest()
    request = f"GET\n{path}\n\n{lines}\n{';'.join(signed)}\n{body}"
    day = (headers["x-amz-date"] or "")[:8]
    scope = f"{day}/{region}/s3/aws4_request"
    key = ("AWS4" + secret_key).encode()
    for part in scope.split("/"):
        key = hmac.digest(key, part.encode(), "sha256")
    text = f"AWS4-HMAC-SHA256\n{headers['x-amz-date']}\n{scope}\n{hashlib.sha256(request.encode()).hexdigest()}"
    return (f"AWS4-HMAC-SHA256 Credential={access_key}/{scope}, SignedHeaders={';'.join(signed)}, "
            f"Signature={hmac.digest(key, text.encode(), 'sha256').hex()}")


class Server(http.server.ThreadingHTTPServer):
    request_queue_size = 64  # connections beyond the queue wait for a second

    def handle_error(self, request, client_address):
        if not isinstance(sys.exc_info()[1], ConnectionError):  # by a process that was killed
            super().handle_error(request, client_address)


class Served(Folder):
    DETAIL = []

    def setUp(self):
        super().setUp()
        _, raster = self.hills(300, 200)
        self.store = self.path("store")
        run_json("bake", "--dem", raster, *self.DETAIL, "--out", self.store, "--sharded")
        self.server = Server(("127.0.0.1", 0), Handler)
        self.server.folder, self.server.requests, self.server.faults = self.store, [], []
        self.server.keys = None
        thread = threading.Thread(target=self.server.serve_forever, kwargs={"poll_interval": 0.05})
        thread.start()
        self.addCleanup(thread.join)
        self.addCleanup(self.server.server_close)
        self.addCleanup(self.server.shutdown)
        self.address = f"http://127.0.0.1:{self.server.server_port}/world/"
        self.cache = ["--http-cache", self.path("cache")]


class Remote(Served):
    def fly(self, name, *terrain):
        out = self.path(name)
        summary = run_json("fly", *terrain, *FLIGHT, "--out", out)
        with open(f"{out}/frames.csv") as file:
            rows = list(csv.DictReader(file))
        return summary, [[row[key] for key in ("eye_x_m", "eye_y_m", "triangles", "error_px")] for row in rows]

    def mesh(self, name, *terrain):
        out = self.path(name)
        run_json("mesh", *terrain, "--eye=0,-900,900", "--look=0,0,500", "--budget", 30_000, "--out", out)
        return self.read(out)

    def test_a_flight_has_the_meshes_of_the_folder(self):
        summary, frames = self.fly("folder", "--dem", self.store)
        self.assertNotIn("http", summary)
        summary, remote = self.fly("remote", "--dem", self.address, *self.cache)
        self.assertEqual(frames, remote)
        self.assertEqual(summary["terrain"], self.address)
        http = summary["http"]
        self.assertEqual(http["requests"], len(self.server.requests))
        self.assertGreater(http["bytes"], 0)
        self.assertEqual((http["failures"], http["retries"], http["cache_faults"]), ({}, 0, 0))

        # Again: from the cache, all but terrain.json. And the mesh of a view, whose blocks are there too.
        count = len(self.server.requests)
        summary, remote = self.fly("again", "--dem", self.address + "terrain.json", *self.cache)
        self.assertEqual(frames, remote)
        self.assertEqual(len(self.server.requests), count + 1)
        self.assertGreater(summary["http"]["disk_hits"], 0)
        self.assertEqual(self.mesh("folder.ply", "--dem", self.store), self.mesh("remote.ply", "--dem", self.address, *self.cache))
        questions = [{"id": i, "op": "height", "x": 37.1 * i - 800, "y": 11.3 * i - 300} for i in range(40)]
        self.assertEqual(ask(["--dem", self.store], questions), ask(["--dem", self.address, *self.cache], questions))

    def bucket(self, name, **environment):
        """The program's answer for a bucket of the server."""
        of_bucket = {"AWS_ENDPOINT_URL": f"http://127.0.0.1:{self.server.server_port}", **environment}
        return subprocess.run([PROGRAM, "info", "--dem", f"s3://{name}/world/", "--http-cache", "off", "--json"], text=True, capture_output=True,
                              env={key: value for key, value in os.environ.items() if not key.startswith("AWS_")} | of_bucket, timeout=100)

    def test_requests_to_buckets_are_signed(self):
        wanted = run_json("info", "--dem", self.store)
        keys = {"AWS_ACCESS_KEY_ID": "AKID", "AWS_SECRET_ACCESS_KEY": "wJalr/K7MDENG+secret", "AWS_REGION": "eu-west-3"}
        self.server.keys = "AKID", "wJalr/K7MDENG+secret", "eu-west-3"
        for session in ({}, {"AWS_SESSION_TOKEN": "Fwo/token+of=keys"}):
            done = self.bucket("my.terrain", **keys, **session)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual(json.loads(done.stdout)["guaranteed_m"], wanted["guaranteed_m"])
        self.assertTrue(self.server.requests[-1][0].startswith("/my.terrain/world/"))
        for wrong in ({"AWS_SECRET_ACCESS_KEY": "other-secret"}, {"AWS_REGION": "us-east-1"}):
            done = self.bucket("my.terrain", **keys | wrong)
            self.assertEqual(done.returncode, 1)
            self.assertIn("403", done.stderr)
            self.assertNotIn("secret", done.stderr)
        # A public bucket, for which credentials of HTTP servers are not meant.
        self.server.keys = None
        done = self.bucket("public", TERRANE_HTTP_AUTHORIZATION="Bearer of-another-server")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIsNone(self.server.requests[-1][2])
        for name, changed, words in (("No", {}, "lower-case"), ("abc", {"AWS_ACCESS_KEY_ID": "x"}, "only one"),
                                     ("abc", {"AWS_REGION": "x/y"}, "s3.region"), ("abc", {"AWS_ENDPOINT_URL": "ftp://x"}, "http, https or s3")):
            done = self.bucket(name, **changed)
            self.assertEqual(done.returncode, 1, done.stderr)
            self.assertIn(words, done.stderr)

    def test_faults_of_the_server_do_not_change_the_flight(self):
        _, frames = self.fly("folder", "--dem", self.store)
        self.server.faults = [500, 503]
        summary, remote = self.fly("remote", "--dem", self.address, "--http-cache", "off")
        self.assertEqual(frames, remote)
        self.assertEqual(summary["http"]["failures"], {"busy": 1, "server_error": 1})
        self.assertEqual(summary["http"]["retries"], 2)

    def test_the_cache_is_a_folder_with_a_ceiling(self):
        terrain = ["--dem", self.address]
        run_json("info", *terrain)
        user = os.path.join(os.environ["XDG_CACHE_HOME"], "terrane", "http")
        shutil.rmtree(user, ignore_errors=True)
        self.fly("user", *terrain)
        self.assertTrue(os.path.isdir(user))
        shutil.rmtree(user)
        self.fly("off", *terrain, "--http-cache", "off", "--http-cache-mb", 8)
        self.assertFalse(os.path.exists(user))
        self.assert_refused(run("info", *terrain, "--http-cache-mb", 7), [2], "--http-cache-mb", "8 to 1e+09", "7")

    def test_secrets_are_sent_and_not_shown(self):
        secret, off = self.address + "?hidden=1", ["--http-cache", "off"]
        credentials = {"TERRANE_HTTP_AUTHORIZATION": "Bearer hidden"}
        done = subprocess.run([PROGRAM, "info", "--dem", secret, *off, "--json"], env=os.environ | credentials, text=True,
                              capture_output=True, timeout=60)
        self.assertEqual(json.loads(done.stdout)["terrain"], self.address)
        self.assertEqual(self.server.requests[0], ("/world/terrain.json?hidden=1", None, "Bearer hidden"))
        record = self.path("record")
        run_json("drive", "--dem", secret, *off, "--seconds", 0.2, "--record", record)
        self.server.requests.clear()
        run_json("fly", "--replay", record, *off, "--size", "160x90", "--out", self.path("again"))
        self.assertEqual(self.server.requests[0][0], "/world/terrain.json")
        done = run("info", "--dem", self.address.replace("//", "//me:hidden@"), *off)
        self.assert_refused(done, [2], "--dem", "~/.netrc")
        self.assertNotIn("hidden", done.stderr)
        os.remove(f"{self.store}/terrain.json")
        done = run("info", "--dem", secret, *off)
        self.assert_refused(done, [1], self.address + "terrain.json", "status 404")
        self.assertNotIn("hidden", done.stderr)

    def test_what_cannot_be_opened_is_one_line(self):
        self.assert_refused(run("info", "--dem", "http://127.0.0.1:99999/"), [1, 2], "http://127.0.0.1:99999/")
        self.assert_refused(run("info", "--dem", self.address, "--seed", 1), [2], "--seed")
        self.server.faults = [404]
        self.assert_refused(run("info", "--dem", self.address + "terrain.json"), [1], "status 404 (not found)")
        with open(f"{self.store}/terrain.json", "w") as file:
            file.write("{}")
        self.assert_refused(run("info", "--dem", self.address), [1], self.address)


class SharedCache(Served):
    """Processes in flight at the same time, over more ground than in memory. With TERRANE_LONG, 100 of them are killed."""

    DETAIL = ["--detail-m", 2.5, "--seed", 7]
    FLIGHT = ["--path", "canyon", "--seconds", 5, "--fps", 3, "--threads", 0, "--budget", 40_000, "--size", "320x180", "--json"]

    def begin(self, name):
        return start("fly", "--dem", self.address, *self.cache, *self.FLIGHT, "--out", self.path(name))

    def frames(self, name):
        return [[row[key] for key in ("eye_x_m", "eye_y_m", "triangles", "error_px")] for row in self.rows(f"{name}/frames.csv")]

    def blocks(self):
        """Files of the cache: complete ones, and those of killed processes."""
        names = [os.path.join(place, name) for place, _, names in os.walk(self.path("cache")) for name in names]
        return [name for name in names if name.endswith(".block")], [name for name in names if not name.endswith(".block")]

    def test_two_flights_at_once_and_killed_ones_read_right_blocks(self):
        kills = 100 if os.environ.get("TERRANE_LONG") else 2
        chance = random.Random(SEED)
        print("seed", SEED)
        run_json("fly", "--dem", self.store, *self.FLIGHT[:-1], "--out", self.path("folder"))
        wanted = self.frames("folder")
        killed = left = flights = 0
        while killed < kills:
            two = [self.begin("first"), self.begin("second")]
            while killed < kills and any(one.poll() is None for one in two):
                for name in self.blocks()[0]:  # so that there is something to write
                    if chance.random() < 0.5:
                        os.remove(name)
                third = self.begin("third")
                before = len(self.server.requests)
                while len(self.server.requests) == before and third.poll() is None:
                    time.sleep(0.001)
                time.sleep(chance.uniform(0.0, 0.3))
                third.kill()
                third.communicate()
                killed += 1
                left = max(left, len(self.blocks()[1]))
            for name, one in zip(("first", "second"), two):
                out, error = one.communicate(timeout=300)
                self.assertEqual((one.returncode, error), (0, ""))
                http = json.loads(out)["http"]
                self.assertEqual((http["failures"], http["damaged_blocks"], http["discarded"], http["cache_faults"]), ({}, 0, 0, 0))
                self.assertEqual(self.frames(name), wanted)
                flights += 1
        # What all of them left: right blocks, which are enough for a flight.
        last = self.begin("last")
        out, error = last.communicate(timeout=300)
        self.assertEqual((last.returncode, error), (0, ""))
        http = json.loads(out)["http"]
        self.assertEqual((http["damaged_blocks"], http["discarded"]), (0, 0))
        self.assertGreater(http["disk_hits"], 0)
        self.assertEqual(self.frames("last"), wanted)
        print(killed, "killed,", flights, "flights,", len(self.blocks()[0]), "blocks, at most", left, "half-written files,", http)


if __name__ == "__main__":
    main()
