# SPDX-License-Identifier: MIT
"""Sources: fractals, rasters, baked stores; terrains over them."""
import http.server
import os
import pathlib
import re
import subprocess
import tempfile
import threading
import unittest

import numpy as np

import terrane
from grounds import PROGRAM, SEED, bilinear, has, hills, loaded, main, small_fractal, write_raster
from terrane import RegionState


class Fractal(unittest.TestCase):
    def test_every_setting_changes_the_heights_or_the_lattice(self):
        def heights(**settings):
            source = terrane.fractal(**{"root_size_log2": 12, **settings})
            x, y = np.random.default_rng(SEED).uniform(-1000, 1000, (2, 50))
            return source.heights(x, y), source.lattice

        for kind, changes in (("fbm", {"seed": 2, "octave_count": 5, "amplitude": 10.0, "wavelength_log2": 8, "gain": 0.4}),
                              ("ridged", {"heterogeneity": 0.1, "crest_rounding": 0.5}), ("warped", {"warp": 0.3}),
                              ("hybrid", {"heterogeneity": 0.2}),
                              ("fbm", {"finest_spacing_log2": 1, "root_size_log2": 13, "first_root": (-2, -3),
                                       "root_count": (3, 4), "origin": (8192.0, -4096.0)})):
            base, lattice = heights(kind=kind)
            for name, value in changes.items():
                changed, changed_lattice = heights(kind=kind, **{name: value})
                self.assertTrue((changed != base).any() or changed_lattice != lattice, f"{kind} {name}")

    def test_samples_are_the_surface_at_lattice_points(self):
        source = small_fractal(finest_spacing_log2=1)
        lattice = source.lattice
        samples = source.sample((-5, 7), 6, 4, 2)
        self.assertEqual(samples.shape, (4, 6))
        x = lattice.origin[0] + lattice.spacing * (-5 + 2 * np.arange(6))
        y = lattice.origin[1] + lattice.spacing * (7 + 2 * np.arange(4))
        surface = source.heights(*np.meshgrid(x, y))
        self.assertLess(np.abs(samples - surface).max(), 1e-9)

    def test_intervals_and_rises_hold(self):
        source = small_fractal()
        self.assertEqual(source.extent, (-1024.0, -1024.0, 1024.0, 1024.0))
        x, y = np.random.default_rng(SEED).uniform(-50, 50, (2, 1000))
        heights = source.heights(x, y)
        low, high = source.interval(-50, -50, 50, 50)
        self.assertTrue(low <= heights.min() and heights.max() <= high)
        self.assertLessEqual(np.ptp(heights), source.rise_bound(150.0))
        with self.assertRaisesRegex(ValueError, "distance"):
            source.rise_bound(-1.0)
        with self.assertRaisesRegex(ValueError, "west"):
            source.interval(50, 0, -50, 1)


@unittest.skipUnless(has("dem"), "rasters are not built")
class Raster(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = pathlib.Path(folder.name) / "hills.asc"
        self.heights = hills()
        write_raster(self.path, self.heights, 10.0)

    def test_heights_are_those_of_the_raster(self):
        source = terrane.open_dem(self.path)
        self.assertEqual((source.info.columns, source.info.rows, source.info.cell), (80, 64, (10.0, 10.0)))
        self.assertAlmostEqual(source.info.max_m, float(self.heights.max()), delta=1e-6)
        x, y = np.random.default_rng(SEED).uniform(-300, 300, (2, 1000))
        expected = bilinear(self.heights, 10.0, x, y)
        self.assertLess(np.abs(source.heights(x, y) - expected).max(), 1e-6)
        answer = loaded(source, (-300, -300, 300, 300)).frame.ground.heights(x, y)
        self.assertTrue((answer.status == 0).all())
        self.assertLessEqual((np.abs(answer.height - expected) - answer.error_m).max(), 1e-9)

    def test_detail_is_added_between_the_samples_and_is_of_its_seed(self):
        plain = terrane.open_dem(str(self.path))
        a, b, c = (terrane.open_dem(self.path, detail_seed=seed, finest_spacing=1.25) for seed in (1, 1, 2))
        self.assertAlmostEqual(a.lattice.spacing, 1.25)
        x, y = np.random.default_rng(SEED).uniform(-200, 200, (2, 200))
        np.testing.assert_array_equal(a.heights(x, y), b.heights(x, y))
        self.assertTrue((a.heights(x, y) != c.heights(x, y)).any())
        self.assertTrue((a.heights(x, y) != plain.heights(x, y)).any())

    def test_a_raster_with_a_crs_has_a_place_on_the_earth(self):
        with self.assertRaisesRegex(ValueError, "no CRS"):
            terrane.open_dem(self.path).georeference()
        with self.assertRaisesRegex(ValueError, "no raster"):
            small_fractal().georeference()
        wkt = ('PROJCS["WGS 84 / UTM zone 32N",GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],'
               'PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]],PROJECTION["Transverse_Mercator"],'
               'PARAMETER["latitude_of_origin",0],PARAMETER["central_meridian",9],PARAMETER["scale_factor",0.9996],'
               'PARAMETER["false_easting",500000],PARAMETER["false_northing",0],UNIT["metre",1]]')
        pathlib.Path(self.path).with_suffix(".prj").write_text(wkt)
        source = terrane.open_dem(self.path)
        earth = source.georeference()
        world = np.array([[0.0, 0.0, 5.0], [100.0, -200.0, 6.0], [np.nan, 0.0, 0.0]])
        lonlat = earth.lonlat_from_world(world)
        self.assertTrue(np.allclose(earth.world_from_lonlat(lonlat)[:2], world[:2], atol=1e-6))
        self.assertTrue(np.isnan(lonlat[2]).all() and (lonlat[:2, 2] == world[:2, 2]).all())
        self.assertTrue((earth.lonlat_from_world(world[1]) == lonlat[1]).all())
        self.assertTrue(np.allclose(earth.crs_from_world(world[0])[:2], source.info.centre))
        self.assertTrue(np.allclose(earth.world_from_crs(earth.crs_from_world(world))[:2], world[:2], atol=1e-6))
        scale = earth.scale_at(0, 0)
        self.assertAlmostEqual(earth.geodesic_length((0, 0, 0), (100, 0, 0)), 100 * scale.x, delta=1e-4)
        self.assertAlmostEqual(scale.x, 1.0, delta=source.info.scale_error)
        self.assertEqual((earth.height_reference, earth.has_ellipsoidal_heights), ("unknown", False))
        self.assertIn("unknown", earth.heights)
        with self.assertRaisesRegex(ValueError, "positions"):
            earth.lonlat_from_world(np.zeros((2, 2)))

    def test_progress_is_told_and_can_cancel_or_raise(self):
        shares = []
        terrane.open_dem(self.path, progress=shares.append)
        self.assertEqual(shares, sorted(shares))
        self.assertTrue(shares and 0 <= shares[0] and shares[-1] <= 1)
        with self.assertRaisesRegex(RuntimeError, "."):
            terrane.open_dem(self.path, progress=lambda share: False)

        def fail(share):
            raise KeyError("my own")

        with self.assertRaisesRegex(KeyError, "my own"):
            terrane.open_dem(self.path, progress=fail)
        with self.assertRaises(TypeError):
            terrane.open_dem(self.path, progress=3)

    def test_a_file_that_is_no_raster_is_an_error_that_names_it(self):
        self.path.write_text("no raster")
        with self.assertRaisesRegex((OSError, ValueError), "hills.asc") as caught:
            terrane.open_dem(self.path)
        self.assertNotIn("\n", str(caught.exception))

    def test_a_void_is_filled_and_says_so(self):
        self.heights[20:24, 30:34] = -9999
        write_raster(self.path, self.heights, 10.0)
        source = terrane.open_dem(self.path)
        self.assertGreater(source.info.filled_share, 0)
        at = loaded(source).frame.ground.heights((31.5 + 0.5 - 40) * 10, (32 - 21.5 - 0.5) * 10)
        self.assertEqual((int(at.status), bool(at.filled)), (0, True))


@unittest.skipUnless(has("store"), "stores are not built")
class Store(unittest.TestCase):
    def test_a_baked_terrain_has_the_chunks_of_its_source(self):
        source = small_fractal(root_size_log2=8, root_count=(1, 1), first_root=(0, 0))
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "small.store")
            shares = []
            info = terrane.bake(source, path, note=b"a note", worker_count=1, progress=shares.append)
            self.assertEqual((info.note, info.chunk_count, len(info.sha)), (b"a note", 5, 64))
            self.assertTrue(shares)
            store = terrane.open_store(path)
            self.assertEqual(store.info, info)
            ours, theirs = (loaded(s, (10, 10, 200, 200)).resident for s in (source, store))
            np.testing.assert_array_equal(ours.keys, theirs.keys)
            for i in range(len(ours)):
                np.testing.assert_array_equal(ours.chunk(i).heights, theirs.chunk(i).heights)
                np.testing.assert_array_equal(ours.chunk(i).cell_bounds, theirs.chunk(i).cell_bounds)
            with self.assertRaisesRegex(RuntimeError, "."):
                terrane.bake(source, path + "2", progress=lambda share: False)
            self.assertFalse(os.path.exists(path + "2"))
            damaged = pathlib.Path(path).read_bytes()[:-100]
            pathlib.Path(path).write_bytes(damaged)
            with self.assertRaises((OSError, ValueError)):
                terrane.open_store(path)

    def bake_shards(self, source, folder, shards=None, **settings):
        baker = terrane.ShardBaker(source, folder, **settings)
        for shard in range(baker.shard_count) if shards is None else shards:
            self.assertTrue(baker.bake_shard(shard))
        return baker

    def files(self, folder):
        return {str(path.relative_to(folder)): path.read_bytes() for path in pathlib.Path(folder).rglob("*") if path.is_file()}

    def test_shards_have_the_chunks_of_the_file_and_the_same_bytes_in_any_order(self):
        source = small_fractal(root_size_log2=8, root_count=(2, 1), first_root=(0, 0))
        with tempfile.TemporaryDirectory() as folder:
            terrane.bake(source, folder + "/one", note=b"a note")
            baker = self.bake_shards(source, folder + "/a", note=b"a note", worker_count=1)
            self.assertEqual(baker.shard_count, 2)
            self.assertTrue(baker.is_baked(1))
            self.assertFalse(baker.bake_shard(1))
            self.assertEqual(baker.verify_shard(0), 1)
            self.assertEqual(baker.verify_shard(0, every=1), 5)
            info = terrane.ShardBaker.combine(folder + "/a")
            self.assertEqual((info.note, info.chunk_count), (b"a note", 10))
            for path in (folder + "/a", folder + "/a/terrain.json"):
                store = terrane.open_store(path)
                self.assertEqual(store.info, info)
                ours, theirs = (loaded(s, (10, 10, 400, 200)).resident for s in (terrane.open_store(folder + "/one"), store))
                np.testing.assert_array_equal(ours.keys, theirs.keys)
                for i in range(len(ours)):
                    np.testing.assert_array_equal(ours.chunk(i).heights, theirs.chunk(i).heights)
            self.bake_shards(source, folder + "/b", [1], note=b"a note")
            again = terrane.ShardBaker(source, folder + "/b", note=b"a note")
            self.assertEqual([again.is_baked(shard) for shard in (0, 1)], [False, True])
            self.assertTrue(again.bake_shard(0))
            terrane.ShardBaker.combine(folder + "/b")
            self.assertEqual(self.files(folder + "/a"), self.files(folder + "/b"))

    def test_shards_that_cannot_be_baked_are_named(self):
        source = small_fractal(root_size_log2=8, root_count=(2, 1), first_root=(0, 0))
        with tempfile.TemporaryDirectory() as folder:
            baker = self.bake_shards(source, folder, [1])
            for call, words in ((lambda: baker.bake_shard(2), "shard must be 0 to 1, got 2"),
                                (lambda: baker.verify_shard(1, 0), "every .* 0"),
                                (lambda: terrane.ShardBaker.combine(folder), "shard 0 of 2"),
                                (lambda: terrane.ShardBaker(source, folder, level_count=9), "level_count .* 9"),
                                (lambda: terrane.ShardBaker(source, folder, fingerprint="x"), "plan.json"),
                                (lambda: terrane.ShardBaker(small_fractal(), folder), "plan.json")):
                with self.assertRaisesRegex(ValueError, words):
                    call()
            for call in (lambda: terrane.ShardBaker.combine(folder + "/none"), lambda: baker.verify_shard(0)):
                with self.assertRaises(OSError):
                    call()
            with self.assertRaises(TypeError):
                terrane.ShardBaker(source, folder, progress=print)

    @unittest.skipUnless(has("dem") and PROGRAM, "needs rasters and the program")
    def test_shards_of_a_raster_have_the_bytes_of_the_program(self):
        with tempfile.TemporaryDirectory() as folder:
            path = folder + "/hills.asc"
            write_raster(path, hills(), 10.0)
            subprocess.run([PROGRAM, "bake", "--dem", path, "--detail-m", "5", "--cache", "off", "--sharded", "--out",
                            folder + "/program"], check=True, capture_output=True)
            source = terrane.open_dem(path, finest_spacing=5, scan_file=folder + "/python/raster.scan")
            self.bake_shards(source, folder + "/python")
            terrane.ShardBaker.combine(folder + "/python")
            self.assertEqual(self.files(folder + "/program"), self.files(folder + "/python"))
            # Without a scan, a file with other bytes has another plan, with the same heights too.
            self.bake_shards(terrane.open_dem(path, finest_spacing=5), folder + "/other")
            pathlib.Path(path).write_text(pathlib.Path(path).read_text() + "\n")
            with self.assertRaisesRegex(ValueError, "plan.json"):
                terrane.ShardBaker(terrane.open_dem(path, finest_spacing=5), folder + "/other")


class Handler(http.server.SimpleHTTPRequestHandler):
    """The files of a folder, with ranges."""

    protocol_version = "HTTP/1.1"

    def do_GET(self):
        self.server.seen.append((self.path, self.headers["User-Agent"]))
        path = pathlib.Path(self.server.folder, pathlib.PurePath(self.path).name)
        if not path.is_file():
            return self.send_error(404)
        content = path.read_bytes()
        wanted = re.match(r"bytes=(\d+)-(\d+)$", self.headers["Range"] or "")
        first, last = map(int, wanted.groups()) if wanted else (0, len(content) - 1)
        self.send_response(206 if wanted else 200)
        if wanted:
            self.send_header("Content-Range", f"bytes {first}-{last}/{len(content)}")
        self.send_header("Content-Length", str(last + 1 - first))
        self.end_headers()
        self.wfile.write(content[first:last + 1])

    def log_message(self, *_):
        pass


@unittest.skipUnless(has("remote"), "HTTP is not built")
class Remote(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        baker = terrane.ShardBaker(small_fractal(root_size_log2=8, root_count=(2, 1), first_root=(0, 0)), self.folder + "/store",
                                   note=b"a note")
        for shard in range(baker.shard_count):
            baker.bake_shard(shard)
        self.info = terrane.ShardBaker.combine(self.folder + "/store")
        self.server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.server.folder, self.server.seen = self.folder + "/store", []
        thread = threading.Thread(target=self.server.serve_forever, kwargs={"poll_interval": 0.05})
        thread.start()
        self.addCleanup(thread.join)
        self.addCleanup(self.server.server_close)
        self.addCleanup(self.server.shutdown)
        self.address = f"http://127.0.0.1:{self.server.server_port}/world/"

    def test_a_server_has_the_chunks_of_the_folder(self):
        ours = loaded(terrane.open_store(self.server.folder), (10, 10, 400, 200)).resident
        for i, url in enumerate((self.address, self.address + "terrain.json")):
            source = terrane.open_http(url, cache_folder=self.folder + "/cache", user_agent="tester/1")
            self.assertEqual(source.info, self.info)
            theirs = loaded(source, (10, 10, 400, 200)).resident
            np.testing.assert_array_equal(ours.keys, theirs.keys)
            for k in range(len(ours)):
                np.testing.assert_array_equal(ours.chunk(k).heights, theirs.chunk(k).heights)
                np.testing.assert_array_equal(ours.chunk(k).cell_bounds, theirs.chunk(k).cell_bounds)
            statistics = source.http_statistics()
            self.assertEqual(statistics.failures, terrane.HttpFailures(*[0] * 11))
            self.assertEqual((statistics.retries, statistics.cache_faults, statistics.damaged_blocks), (0, 0, 0))
            # The second time all blocks are in the cache, and only terrain.json is asked for.
            self.assertEqual((statistics.requests > 1, statistics.disk_hits > 0), (i == 0, i == 1))
            self.assertGreater(statistics.bytes, 0)
            self.assertGreater(statistics.latency, 0)
        self.assertEqual({agent for _, agent in self.server.seen}, {"tester/1"})
        with self.assertRaisesRegex(ValueError, "open_http"):
            small_fractal().http_statistics()

    def test_what_cannot_be_opened_is_named(self):
        for call, error, words in (
                (lambda: terrane.open_http("ftp://127.0.0.1/"), ValueError, "ftp"),
                (lambda: terrane.open_http(self.address, connection_count=0), ValueError, "connection_count .* 0"),
                (lambda: terrane.open_http(self.address, block_bytes=5000), ValueError, "block_bytes .* 5000"),
                (lambda: terrane.open_http("s3://abc/", s3_region="x/y"), ValueError, "s3.region"),
                (lambda: terrane.open_http(self.address, blocks=1), TypeError, "blocks")):
            with self.assertRaisesRegex(error, words) as caught:
                call()
            self.assertNotIn("\n", str(caught.exception))
        os.remove(self.server.folder + "/terrain.json")
        with self.assertRaisesRegex(OSError, "terrain.json.*404"):
            terrane.open_http(self.address)


class Paging(unittest.TestCase):
    def test_a_required_region_is_ready_after_load_and_forgotten_after_release(self):
        with terrane.Terrain(small_fractal(), worker_count=0, contact_spacing=4.0) as terrain:
            region = terrain.require((-50, -50, 50, 50))
            self.assertFalse(region.is_ready)
            terrain.load([], None, 0.0)
            self.assertTrue(region.is_ready)
            self.assertEqual(region.state, RegionState.ready)
            resident = terrain.resident
            self.assertEqual(len(resident), terrain.stats.resident_chunks)
            self.assertEqual((resident.keys.dtype, resident.keys.shape), (np.int32, (len(resident), 3)))
            chunk = resident.chunk(len(resident) - 1)
            self.assertEqual(chunk.spacing, 4.0)
            self.assertEqual(chunk.key, tuple(resident.keys[-1]))
            self.assertEqual(terrain.last_failure, "")
            region.release()
            region.release()
            self.assertEqual(region.state, RegionState.released)
        with self.assertRaisesRegex(ValueError, "this Terrain is closed"):
            region.state

    def test_bodies_and_cameras_are_needs(self):
        terrain = terrane.Terrain(small_fractal(), worker_count=0)
        bodies = terrane.BodyNeeds(np.array([[200.0, 200.0, 50.0]]), radius=2.0)
        self.assertEqual(len(bodies), 1)
        camera = terrane.Camera(terrane.look_at((-500, -500, 200), (-300, -300, 0)), (1, 0, 0))
        self.assertEqual(camera.velocity.tolist(), [1, 0, 0])
        self.assertTrue(np.isnan(terrain.frame.ground.heights(200.0, 200.0).height))
        frame = terrain.load([camera], bodies, 0.0)
        self.assertTrue(np.isfinite(frame.ground.heights(200.0, 200.0).height))
        self.assertEqual((len(frame.meshes), frame.late_chunks, frame.groundless_bodies), (1, 0, 0))
        self.assertEqual(terrain.frame.meshes[0].triangle_count, frame.meshes[0].triangle_count)
        levels = terrain.resident.keys[:, 0]
        self.assertGreater((levels == levels.max()).sum(), 1)
        self.assertTrue(terrain.resident.has_roots)
        self.assertEqual(terrain.resident.fades.shape, (len(terrain.resident),))

    def test_a_closed_terrain_is_a_value_error(self):
        terrain = terrane.Terrain(small_fractal(), worker_count=1)
        terrain.close()
        terrain.close()
        self.assertTrue(terrain.closed)
        for call in (lambda: terrain.update([], None, 0.0), lambda: terrain.load([], None, 0.0), lambda: terrain.frame,
                     lambda: terrain.resident, lambda: terrain.stats, lambda: terrain.require((0, 0, 1, 1))):
            with self.assertRaisesRegex(ValueError, "this Terrain is closed"):
                call()

    def test_bad_needs_are_refused(self):
        terrain = terrane.Terrain(small_fractal(), worker_count=0)
        with self.assertRaisesRegex(ValueError, "time_s"):
            terrain.update([], None, float("nan"))
        with self.assertRaisesRegex(TypeError, "bodies"):
            terrain.update([], 3, 0.0)
        with self.assertRaises(TypeError):
            terrain.update([3], None, 0.0)
        with self.assertRaises(TypeError):
            terrane.Terrain(3)
        with self.assertRaisesRegex(ValueError, "centre_world has 2 rows, radius has 3"):
            terrane.BodyNeeds(np.zeros((2, 3)), radius=np.ones(3))


main()
