#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Formats of `mesh`: chosen by the extension, the same mesh in each, other extensions refused."""

import json
import os
import struct

from program import SMALL_WORLD, Folder, main, np, read_obj, run_json, start


def read_glb(path):
    """Vertices in world axes and faces; checks the file against the glTF specification."""
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
    assert np.abs(np.linalg.norm(directions.astype(float), axis=1) - 1).max() < 1e-6 and directions[:, 1].min() > 0
    indices, faces = array(primitive["indices"], "<u4", 1)
    assert (indices["componentType"], indices["type"]) == (5125, "SCALAR")
    x, y, z = (points.astype(float) + scene["nodes"][0]["translation"]).T
    return np.stack([x, -z, y], axis=1), faces.reshape(-1, 3).astype(np.int64)


class MeshFormats(Folder):
    def test_obj_and_glb_hold_the_mesh_of_the_ply(self):
        summaries = [run_json("mesh", *SMALL_WORLD, "--budget", 3000, "--out", self.path(name))
                     for name in ("m.ply", "m.obj", "m.OBJ", "m.glb")]
        for summary in summaries:
            summary.pop("out")
        self.assertEqual(summaries, summaries[:1] * 4)
        body = self.read("m.ply").split(b"end_header\n", 1)[1]
        count = summaries[0]["vertices"]
        vertices = np.frombuffer(body, "<f8", 3 * count).reshape(-1, 3)
        faces = np.frombuffer(body, np.dtype([("n", "u1"), ("v", "<u4", 3)]), offset=24 * count)["v"]
        for name in ("m.obj", "m.OBJ"):
            obj_vertices, obj_faces = read_obj(self.path(name))
            self.assertTrue(np.array_equal(obj_vertices, vertices))  # every digit
            self.assertTrue(np.array_equal(obj_faces, faces))
        glb_vertices, glb_faces = read_glb(self.path("m.glb"))
        self.assertTrue(np.array_equal(glb_faces, faces))
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


if __name__ == "__main__":
    main()
