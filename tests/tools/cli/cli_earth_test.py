#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Longitude and latitude: where rasters, tracks, questions and meshes are on the Earth."""

import math

import numpy as np

from program import Folder, ask, main, read_obj, run, run_json

WGS84 = ('GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],PRIMEM["Greenwich",0],'
         'UNIT["degree",0.0174532925199433]]')
PARIS = ('GEOGCS["NTF (Paris)",DATUM["Nouvelle_Triangulation_Francaise_Paris",SPHEROID["Clarke 1880 (IGN)",6378249.2,'
         '293.4660212936269],TOWGS84[-168,-60,320,0,0,0,0]],PRIMEM["Paris",2.33722917],UNIT["grad",0.01570796326794897]]')
UTM32 = ('PROJCS["WGS 84 / UTM zone 32N",' + WGS84 + ',PROJECTION["Transverse_Mercator"],PARAMETER["latitude_of_origin",0],'
         'PARAMETER["central_meridian",9],PARAMETER["scale_factor",0.9996],PARAMETER["false_easting",500000],'
         'PARAMETER["false_northing",0],UNIT["metre",1]]')


class Earth(Folder):
    def raster(self, name, crs, west, south, cell, side=40, height=100.0):
        """A flat raster of a CRS; "": none."""
        rows = "\n".join(" ".join([str(height)] * side) for _ in range(side))
        if crs:
            self.write(name + ".prj", crs)
        return self.write(name + ".asc", f"ncols {side}\nnrows {side}\nxllcorner {west}\nyllcorner {south}\n"
                                         f"cellsize {cell}\n{rows}\n")

    def utm(self):
        # Around 9 degrees 38 minutes east, 45 degrees 9 minutes north
        return self.raster("utm", UTM32, 548000, 4998000, 100)

    def track(self, *places):
        points = "".join(f'<trkpt lon="{lon}" lat="{lat}"><ele>300</ele></trkpt>' for lon, lat in places)
        return self.write("track.gpx", f"<gpx><trk><trkseg>{points}</trkseg></trk></gpx>")

    def flown(self, raster, *places):
        """x and y of the frames of a flight along places, metres; the last frame is up to 50 m before the end."""
        done = run("fly", "--dem", raster, "--path", self.track(*places), "--speed", 50, "--fps", 1, "--size", "64x64",
                   "--budget", 3000, "--out", self.path("out"), "--cache", "off")
        self.assertEqual(done.returncode, 0, done.stderr)
        columns = self.columns()
        return columns["eye_x_m"], columns["eye_y_m"]

    def test_a_track_flies_over_gons_from_paris(self):
        # 54.28 gon north on the meridian of Paris, as gdaltransform places them in WGS 84
        raster = self.raster("paris", PARIS, -0.02, 54.26, 0.001)
        x, y = self.flown(raster, (2.33650564, 48.85193067), (2.34050564, 48.85193067))
        self.assertAlmostEqual(x[0], 0.0, delta=1.0)
        self.assertAlmostEqual(y[0], 0.0, delta=1.0)
        self.assertAlmostEqual(x[-1], 0.004 * 73300 - 25, delta=28.0)
        self.assertAlmostEqual(y[-1], 0.0, delta=1.0)

    def test_a_track_flies_over_the_antimeridian_and_degrees_to_360(self):
        for west, shift in ((179.98, 0), (-180.02, 0), (179.98, 360)):
            raster = self.raster("seam", WGS84, west, -0.02, 0.001)
            x, y = self.flown(raster, (179.996, 0.0), (-179.996 + shift, 0.0))
            self.assertAlmostEqual(x[0], -445.3, delta=5.0)
            self.assertAlmostEqual(x[-1], 445.3 - 25, delta=28.0)
            self.assertAlmostEqual(np.abs(y).max(), 0.0, delta=1e-6)

    def test_a_track_flies_over_a_projection(self):
        # gdaltransform places it at 549995.562, 4999810.446; the middle of the raster is at 550000, 5000000.
        x, y = self.flown(self.utm(), (9.636, 45.15), (9.64, 45.15))
        self.assertAlmostEqual(x[0], -4.438, delta=0.01)
        self.assertAlmostEqual(y[0], -189.554, delta=0.01)
        # True east is 0.45 degrees north of the grid's.
        self.assertAlmostEqual((y[-1] - y[0]) / (x[-1] - x[0]), math.tan(math.radians(0.451)), delta=1e-4)

    def test_info_tells_scale_and_north_at_the_middle_and_the_corners(self):
        info = run_json("info", "--dem", self.utm())
        middle = info["middle"]
        # On the central meridian the scale of UTM is 0.9996, and 50 km from it larger by (50 / 6382)^2 / 2.
        factor = 0.9996 * (1 + (50 / 6382) ** 2 / 2)
        self.assertAlmostEqual(middle["scale"][0], 1 / factor, delta=2e-6)
        self.assertAlmostEqual(middle["scale"][1], 1 / factor, delta=2e-6)
        lon, lat = middle["lonlat"]
        convergence = math.degrees(math.atan(math.tan(math.radians(lon - 9)) * math.sin(math.radians(lat))))
        self.assertAlmostEqual(middle["convergence_deg"], convergence, delta=1e-3)
        for place in ("south_west", "south_east", "north_west", "north_east"):
            self.assertEqual(list(info[place]), ["lonlat", "scale", "convergence_deg"])
        self.assertLess(info["south_west"]["lonlat"][0], info["north_east"]["lonlat"][0])
        self.assertGreater(info["scale_error"], 3.6e-4)
        self.assertLess(info["scale_error"], 4.1e-4)
        self.assertIn("unknown", info["heights"])
        bare = run_json("info", "--dem", self.raster("bare", "", 0, 0, 10))
        self.assertEqual(bare["heights"], "unknown, the raster has no CRS")
        self.assertNotIn("middle", bare)

    def test_questions_are_asked_and_answered_in_longitude_and_latitude(self):
        dem = ["--dem", self.utm()]
        lon, lat = run_json("info", *dem)["middle"]["lonlat"]
        height, plain, ball, ray, wrong, both, far = ask(dem, [
            {"op": "height", "lonlat": [lon + 360, lat]},
            {"op": "height", "x": 100, "y": 200, "lonlat": True},
            {"op": "find", "shape": {"sphere": {"radius": 1}}, "lonlat": [lon, lat, 100.5]},
            {"op": "ray", "from_lonlat": [lon, lat, 500], "to_lonlat": [lon, lat, 0]},
            {"op": "height", "lonlat": [lon]},
            {"op": "height", "x": 1, "y": 2, "lonlat": [lon, lat]},
            {"op": "height", "lonlat": [lon, 91]},
        ])
        self.assertEqual(height["status"], "ok")
        self.assertAlmostEqual(height["height"], 100.0, delta=1e-3)
        self.assertAlmostEqual(height["lonlat"][0], lon, delta=1e-9)
        self.assertAlmostEqual(plain["lonlat"][1], lat + 200 / 111_140, delta=2e-5)
        self.assertTrue(ball["hit"])
        self.assertAlmostEqual(ray["point"][2], 100.0, delta=1e-3)
        self.assertAlmostEqual(ray["lonlat"][1], lat, delta=1e-8)
        for answer, word in ((wrong, "[longitude, latitude]"), (both, "exclude each other"), (far, "no place")):
            self.assertEqual(answer["status"], "invalid")
            self.assertIn(word, answer["message"])

    def test_a_baked_raster_keeps_its_place_on_the_earth(self):
        raster, baked = self.utm(), self.path("utm.terrane")
        run_json("bake", "--dem", raster, "--out", baked)
        self.assertEqual(run_json("info", "--dem", raster)["middle"], run_json("info", "--dem", baked)["middle"])

    def test_meshes_are_written_in_longitude_and_latitude(self):
        terrain = ["mesh", "--dem", self.utm(), "--budget", 500, "--size", "64x64"]
        run_json(*terrain, "--out", self.path("world.obj"))
        run_json(*terrain, "--out", self.path("earth.obj"), "--lonlat")
        world, earth = read_obj(self.path("world.obj"))[0], read_obj(self.path("earth.obj"))[0]
        self.assertEqual(len(world), len(earth))
        self.assertTrue(np.all((earth[:, 0] > 9.5) & (earth[:, 0] < 9.8) & (earth[:, 1] > 45) & (earth[:, 1] < 45.3)))
        self.assertTrue(np.array_equal(world[:, 2], earth[:, 2]))
        run_json(*terrain, "--out", self.path("earth.ply"), "--lonlat")
        for name, words in (("world.obj", b"x east"), ("earth.obj", b"x longitude"), ("earth.ply", b"x longitude")):
            self.assertIn(words, self.read(name)[:200])
        self.assert_refused(run(*terrain, "--lonlat", "--out", self.path("earth.glb")), {2}, "--lonlat")

    def test_objects_are_written_in_the_frame_of_their_ground(self):
        place = np.array([500.0, -300.0, 100.0])
        objects = [{"mesh": self.write_block((-2, -1, 0), (2, 1, 3)), "position": list(place)}]
        block = np.array([(x, y, z) for z in (0, 3) for y in (-1, 1) for x in (-2, 2)]) + place
        for project in ("none", "local"):
            dem = {"dem": self.utm(), "project": project}
            terrain = ["mesh", "--scene", self.scene(**dem, objects=objects), "--budget", 500, "--size", "64x64"]
            corners = []
            for name, *flags in (("world.obj",), ("earth.obj", "--lonlat")):
                self.assertEqual(run_json(*terrain, *flags, "--out", self.path(name))["objects"], 1)
                corners.append(read_obj(self.path(name))[0][-8:])
            order = np.lexsort(np.round(corners[0], 6).T)
            self.assertLess(np.abs(corners[0][order] - block).max(), 1e-9)
            answers = ask(["--scene", self.scene(**dem)], [{"op": "height", "x": x, "y": y, "lonlat": True} for x, y, _ in block])
            lonlat = np.array([answer["lonlat"] for answer in answers])
            # The answers are of z 0. In the plane z is along the normal at its middle, 583 m away: 103 m of it are
            # 9 mm aside, and the ground falls by 27 mm.
            self.assertLess(np.abs(corners[1][order, :2] - lonlat).max(), 1e-9 if project == "none" else 2e-7)
            self.assertLess(np.abs(corners[1][order, 2] - block[:, 2]).max(), 1e-9 if project == "none" else 0.03)

    def test_a_baked_plane_is_the_plane_of_its_raster(self):
        dem, baked = ["--dem", self.utm(), "--project", "local"], self.path("plane.terrane")
        run_json("bake", *dem, "--out", baked)
        of_raster, of_store = run_json("info", *dem), run_json("info", "--dem", baked)
        for key in ("middle_lonlat", "middle", "south_west", "north_east", "crs", "crs_from_world", "world_from_crs", "scale_error",
                    "resampling_error_m"):
            self.assertEqual(of_raster.get(key), of_store.get(key), key)
        self.assertNotIn("middle_lonlat", run_json("info", "--dem", self.utm()))

    def test_a_start_is_given_in_longitude_and_latitude(self):
        dem = ["--dem", self.utm()]
        lon, lat = run_json("info", *dem)["middle"]["lonlat"]
        mesh = ["mesh", *dem, "--budget", 500, "--size", "64x64"]
        given, metres = (run_json(*mesh, *start) for start in (["--start-lonlat", f"{lon},{lat}"], ["--start-m", "0,0"]))
        self.assertTrue(np.allclose(given["eye_m"], metres["eye_m"], atol=1e-3))
        self.assert_refused(run(*mesh, "--start-lonlat", f"{lon + 1},{lat}"), {1}, "--start-lonlat", "over the raster")
        self.assert_refused(run("info", "--seed", 1, "--start-lonlat", "1,2"), {2}, "--start-lonlat")

    def test_a_raster_without_a_crs_has_no_longitudes(self):
        dem = ["--dem", self.raster("bare", "", 0, 0, 10)]
        track = self.track((1, 2), (1, 2.001))
        self.assert_all_refused([
            (["fly", *dem, "--path", track], "raster with a CRS"),
            (["drive", *dem, "--path", track], "raster with a CRS"),
            (["info", *dem, "--start-lonlat", "1,2"], "--start-lonlat", "no CRS"),
            (["mesh", *dem, "--lonlat", "--out", self.path("a.obj")], "--lonlat", "no CRS"),
        ], {1, 2})
        self.assertIn("no CRS", ask(dem, [{"op": "height", "lonlat": [1, 2]}])[0]["message"])

    def test_mercators_metres_become_metres_of_the_ground(self):
        # 60 degrees north: a metre of the ground is nearly two of the map.
        crs = ('PROJCS["WGS 84 / Pseudo-Mercator",' + WGS84 + ',PROJECTION["Mercator_Auxiliary_Sphere"],'
               'PARAMETER["false_easting",0],PARAMETER["false_northing",0],PARAMETER["central_meridian",0],'
               'PARAMETER["standard_parallel_1",0],PARAMETER["auxiliary_sphere_type",0],UNIT["metre",1]]')
        dem = ["--dem", self.raster("web", crs, 1e6, 8399737.9 - 200, 10)]
        info = run_json("info", *dem)
        self.assertAlmostEqual(info["extent_m"][2], 100.0, delta=0.5)
        for along in info["middle"]["scale"]:
            self.assertAlmostEqual(along, 1.0, delta=2e-6)
        self.assertLess(info["scale_error"], 1e-3)


if __name__ == "__main__":
    main()
