#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""`mesh`: formats by the extension, the same mesh in each, other extensions refused; the objects of a scene."""

import json
import os
import struct

from program import ROOT, SMALL_WORLD, Folder, main, np, read_obj, run, run_json, start


def read_ply(path):
    """Vertices and faces of a file without attributes."""
    with open(path, "rb") as file:
        head, body = file.read().split(b"end_header\n", 1)
    count = int(head.split(b"element vertex ")[1].split()[0])
    vertices = np.frombuffer(body, "<f8", 3 * count).reshape(-1, 3)
    return vertices, np.frombuffer(body, np.dtype([("n", "u1"), ("v", "<u4", 3)]), offset=24 * count)["v"]


def read_glb(path):
    """Vertices in world axes, faces, and normals in world axes; checks the file against the glTF specification."""
    with open(path, "rb") as file:
        content = file.read()
    magic, version, size, json_size, json_kind = struct.unpack_from("<4sIII4s", content)
    assert (magic, version, size, json_kind) == (b"glTF", 2, len(content), b"JSON")
    assert json_size % 4 == 0
    scene = json.loads(content[20:20 + json_size])
    binary_size, binary_kind = struct.unpack_from("<I4s", content, 20 + json_size)
    assert binary_kind == b"BIN\0" and 28 + json_size + binary_size == len(content)
    binary = content[28 + json_size:]
    assert scene["buffers"] == [{"byteLength": binary_size}]
    assert scene["scenes"][scene["scene"]]["nodes"] == [0]
    [primitive] = scene["meshes"][scene["nodes"][0]["mesh"]]["primitives"]

    def array(index, kind, columns):
        accessor = scene["accessors"][index]
        view = scene["bufferViews"][accessor["bufferView"]]
        assert view["byteLength"] == accessor["count"] * columns * 4 and view["byteOffset"] % 4 == 0
        values = np.frombuffer(binary, kind, accessor["count"] * columns, view["byteOffset"])
        return accessor, values.reshape(-1, columns)

    positions, points = array(primitive["attributes"]["POSITION"], "<f4", 3)
    assert (positions["componentType"], positions["type"]) == (5126, "VEC3")
    assert np.array_equal(np.float32(positions["min"]), points.min(axis=0))
    assert np.array_equal(np.float32(positions["max"]), points.max(axis=0))
    normals, directions = array(primitive["attributes"]["NORMAL"], "<f4", 3)
    assert (normals["componentType"], normals["type"]) == (5126, "VEC3") and len(directions) == len(points)
    assert np.abs(np.linalg.norm(directions.astype(float), axis=1) - 1).max() < 1e-6
    indices, faces = array(primitive["indices"], "<u4", 1)
    assert (indices["componentType"], indices["type"]) == (5125, "SCALAR")
    x, y, z = (points.astype(float) + scene["nodes"][0]["translation"]).T
    return np.stack([x, -z, y], axis=1), faces.reshape(-1, 3).astype(np.int64), directions[:, [0, 2, 1]] * [1, -1, 1]


class MeshFormats(Folder):
    def test_obj_and_glb_hold_the_mesh_of_the_ply(self):
        summaries = [run_json("mesh", *SMALL_WORLD, "--budget", 3000, "--out", self.path(name))
                     for name in ("m.ply", "m.obj", "m.OBJ", "m.glb")]
        for summary in summaries:
            summary.pop("out")
        self.assertEqual(summaries, summaries[:1] * 4)
        vertices, faces = read_ply(self.path("m.ply"))
        self.assertEqual((len(vertices), len(faces)), (summaries[0]["vertices"], summaries[0]["triangles"]))
        for name in ("m.obj", "m.OBJ"):
            obj_vertices, obj_faces = read_obj(self.path(name))
            self.assertTrue(np.array_equal(obj_vertices, vertices))  # every digit
            self.assertTrue(np.array_equal(obj_faces, faces))
        glb_vertices, glb_faces, normals = read_glb(self.path("m.glb"))
        self.assertTrue(np.array_equal(glb_faces, faces))
        self.assertGreater(normals[:, 2].min(), 0)
        half = (vertices.max(axis=0) - vertices.min(axis=0)).max() / 2
        self.assertLessEqual(np.abs(glb_vertices - vertices).max(), half * 2**-24)

    def test_a_file_that_the_user_names_is_replaced(self):
        run_json("mesh", *SMALL_WORLD, "--budget", 8, "--out", self.write("m.obj", "old"))
        self.assertEqual(len(read_obj(self.path("m.obj"))[1]), 8)
        self.assertEqual(os.listdir(self.folder), ["m.obj"])

    def test_a_pipe_gets_ply(self):
        os.mkfifo(self.path("pipe"))
        process = start("mesh", *SMALL_WORLD, "--budget", 8, "--out", self.path("pipe"))
        with open(self.path("pipe"), "rb") as pipe:
            self.assertTrue(pipe.read().startswith(b"ply\n"))
        _, error = process.communicate(timeout=60)
        self.assertEqual((process.returncode, error), (0, ""))


class MeshOfCliff(Folder):
    def test_rough_ground_beside_flat_ground_is_met(self):
        # vertices on the line between them need chunks of the flat ground, which deviates nowhere
        heights = np.zeros((1024, 1024))
        heights[:512] = np.round(300 + np.random.default_rng(3).uniform(-25, 25, (512, 1024)), 1)
        raster = self.write_grid("cliff.asc", heights, 10.0)
        for eye, error_px in (("0,-9000,3000", 3), ("3000,-16000,900", 1.5)):
            summary = run_json("mesh", "--dem", raster, f"--eye={eye}", "--look=0,0,200", "--budget", 1_000_000, "--max-error-px", error_px,
                               "--out", self.path("cliff.ply"))
            self.assertEqual(summary["status"], "error_met")
            self.assertLessEqual(summary["error_px"], error_px)


class MeshObjects(Folder):
    """Against boxes whose corners are computed here."""

    PLACES = [{"position": [10, 20, 5], "rotation": [np.cos(0.4), 0, 0, np.sin(0.4)], "scale": 1.5},
              {"position": [-60, -40, 0]}, {"position": [150, -80, 30], "scale": 2}]

    def blocks(self, places):
        return [{"mesh": self.write_block((-2, -1, 0), (2, 1, 3)), **place} for place in places]

    def corners(self, place):
        box = np.array([(x, y, z) for x in (-2, 2) for y in (-1, 1) for z in (0, 3)]) * place.get("scale", 1)
        w, _, _, z = place.get("rotation", [1, 0, 0, 0])
        turn = np.array([[w * w - z * z, -2 * w * z, 0], [2 * w * z, w * w - z * z, 0], [0, 0, 1]])
        return box @ turn.T + place["position"]

    def test_every_format_has_the_objects_after_the_ground(self):
        scene = ["mesh", "--scene", self.scene(dem=self.flat(), objects=self.blocks(self.PLACES))]
        run_json(*scene, "--no-objects", "--out", self.path("ground.ply"))
        ground_vertices, ground_faces = read_ply(self.path("ground.ply"))
        for name, read, accuracy in (("m.ply", read_ply, 1e-12), ("m.obj", read_obj, 1e-12), ("m.glb", read_glb, 2e-5)):
            with self.subTest(name):
                summary = run_json(*scene, "--out", self.path(name))
                vertices, faces, *normals = read(self.path(name))
                self.assertEqual(summary["triangles"], len(faces))
                self.assertEqual(summary["vertices"], len(vertices))
                self.assertEqual([summary[key] for key in ("ground_triangles", "object_triangles", "objects", "objects_left_out")],
                                 [len(ground_faces), 36, 3, 0])
                self.assertTrue(np.array_equal(faces[:-36], ground_faces))
                count = len(ground_vertices)
                self.assertLess(np.abs(vertices[:count] - ground_vertices).max(), accuracy + 1e-9)
                for i, place in enumerate(self.PLACES):
                    part = vertices[faces[len(faces) - 36 + 12 * i:][:12]]
                    corners = self.corners(place)
                    for axis in range(3):
                        self.assertAlmostEqual(part[..., axis].min(), corners[:, axis].min(), delta=accuracy + 1e-9)
                        self.assertAlmostEqual(part[..., axis].max(), corners[:, axis].max(), delta=accuracy + 1e-9)
                    a, b, c = (part - corners[0]).transpose(1, 0, 2)
                    volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6
                    self.assertAlmostEqual(volume / place.get("scale", 1) ** 3, 24, delta=24 * (1e-9 + accuracy))
                if normals:  # of a box: along its sides
                    side = np.cross(*(np.diff(vertices[faces[-36:]], axis=1)).transpose(1, 0, 2))
                    side /= np.linalg.norm(side, axis=1, keepdims=True)
                    at_corners = normals[0][faces[-36:]]
                    self.assertGreater(np.einsum("ij,ikj->ik", side, at_corners).min(), 0.999)
                else:  # corners of a box are shared
                    self.assertEqual(len(vertices), count + 3 * 8)

    def test_one_budget_is_kept_and_what_it_leaves_out_is_counted(self):
        pine = os.path.join(ROOT, "tools", "data", "pine.obj")
        scene = self.scene(seed=3, objects=[{"scatter": {"mesh": pine, "per_km2": 3000, "seed": 2}},
                                            {"mesh": pine, "position": [0, 0, 900], "scale": 20}])
        last = 0
        for budget in (1000, 8000, 10_000_000):
            done = run("mesh", "--scene", scene, "--world-m", 4096, "--eye", "0,-300,300", "--look", "0,300,100", "--budget", budget,
                       "--max-error-px", 4, "--out", self.path("m.ply"), "--json")
            self.assertEqual(done.returncode, 0, done.stderr)
            summary = json.loads(done.stdout)
            self.assertEqual(len(read_ply(self.path("m.ply"))[1]), summary["triangles"])
            self.assertEqual(summary["triangles"], summary["ground_triangles"] + summary["object_triangles"])
            self.assertLessEqual(summary["triangles"], budget)
            self.assertGreater(summary["objects"], last)
            last = summary["objects"]
            is_enough = budget == 10_000_000
            self.assertEqual(summary["objects_left_out"] == 0, is_enough)
            self.assertEqual(summary["object_error_px"] == 4, is_enough)
            self.assertEqual(done.stderr, "" if is_enough else f"terrane: --budget {budget} leaves out "
                             f"{summary['objects_left_out']} scattered objects in view of more than --max-error-px\n")
        self.assertGreater(last, 300)

    def test_a_budget_below_that_of_the_placed_objects_is_refused_with_what_is_needed(self):
        places = [{"position": [10 * i - 190, 0, 0]} for i in range(40)]
        scene = ["mesh", "--scene", self.scene(dem=self.flat(), objects=self.blocks(places))]
        done = run(*scene, "--budget", 481)
        self.assert_refused(done, [1], "480 triangles for its 40 placed objects", "got 481", "--no-objects")
        least = int(done.stderr.split("at least ")[1].split()[0])
        self.assertGreaterEqual(least, 482)
        summary = run_json(*scene, "--budget", least)
        self.assertEqual([summary["objects"], summary["object_triangles"]], [40, 480])
        self.assertLessEqual(summary["triangles"], least)
        self.assertNotIn("objects", run_json(*scene, "--budget", 481, "--no-objects"))


if __name__ == "__main__":
    main()
