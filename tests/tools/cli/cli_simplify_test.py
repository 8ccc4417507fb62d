#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""`simplify`: limits, formats, the certified error against distances between sampled points, bad files."""

import json
import os
import struct

from program import DATA, ROOT, SEED, Folder, main, np, read_obj, run, run_json

KEYS = ["triangles", "vertices", "error_m", "ms", "stop", "input_triangles", "out"]


def distance_to_triangles(points, vertices, faces):
    """[points] the least distance to any of the triangles: inside of the triangle to its plane, else to an edge."""
    best = np.full(len(points), np.inf)
    for face in faces:
        corners = vertices[face]
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        inside = np.full(len(points), np.dot(normal, normal) > 0.0)
        distance = np.full(len(points), np.inf)
        for i in range(3):
            a, edge = corners[i], corners[(i + 1) % 3] - corners[i]
            along = np.clip((points - a) @ edge / max(np.dot(edge, edge), 1e-300), 0.0, 1.0)
            distance = np.minimum(distance, np.linalg.norm(points - a - along[:, None] * edge, axis=1))
            inside &= (points - a) @ np.cross(normal, edge) >= 0.0
        if inside.any():
            height = np.abs((points - corners[0]) @ normal) / np.linalg.norm(normal)
            distance = np.where(inside, np.minimum(distance, height), distance)
        best = np.minimum(best, distance)
    return best


def sample(vertices, faces, count, random):
    """So many points of the triangles, and at most as many of their vertices."""
    corners = vertices[faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    chosen = corners[random.choice(len(faces), count, p=area / area.sum())]
    weights = random.dirichlet([1.0, 1.0, 1.0], count)
    used = random.permutation(np.unique(faces))[:count]
    return np.concatenate([np.einsum("ni,nij->nj", weights, chosen), vertices[used]])


class Simplify(Folder):
    def bumps(self, name="in.obj", side=24):
        """A grid of bumps; the first vertex is in no triangle."""
        ramp = np.arange(side)
        x, y = (axis.ravel() for axis in np.meshgrid(ramp, ramp))
        z = np.sin(0.7 * x) * np.cos(0.5 * y)
        lines = ["v 99 99 99", *("v %r %r %r" % tuple(map(float, point)) for point in zip(x, y, z))]
        for row in range(side - 1):
            for a in range(2 + row * side, 1 + (row + 1) * side):
                lines.append(f"f {a} {a + 1} {a + side + 1} {a + side}")
        return self.write(name, "\n".join(lines) + "\n")

    def simplify(self, source, name, *limits):
        summary = run_json("simplify", source, self.path(name), *limits)
        self.assertEqual(list(summary), KEYS)
        return summary

    def check_error(self, source, out, error):
        """No sampled point is farther from the other surface than the error; returns the largest distance."""
        random = np.random.default_rng(SEED)
        first, second = read_obj(source), read_obj(out)
        measured = max(distance_to_triangles(sample(*first, 300, random), *second).max(),
                       distance_to_triangles(sample(*second, 300, random), *first).max())
        self.assertLessEqual(measured, error + 1e-9, f"seed {SEED}")
        return measured

    def test_each_limit_stops_and_the_error_holds(self):
        source = self.bumps()
        for limits, stop in ((["--triangles", 200], "triangles"), (["--error", 0.2], "error"),
                             (["--triangles", 200, "--error", 1e6], "triangles"),
                             (["--triangles", 1, "--error", 0.1], "error")):
            with self.subTest(limits):
                summary = self.simplify(source, "out.obj", *limits)
                vertices, faces = read_obj(self.path("out.obj"))
                self.assertEqual((summary["triangles"], summary["vertices"]), (len(faces), len(vertices)))
                self.assertEqual(summary["input_triangles"], 2 * 23 * 23)
                self.assertLess(len(faces), summary["input_triangles"])
                self.assertEqual(summary["stop"], stop)
                self.assertTrue(np.array_equal(np.unique(faces), np.arange(len(vertices))))  # all are used
                flags = dict(zip(limits[::2], limits[1::2]))
                if stop == "triangles":
                    self.assertLessEqual(len(faces), flags["--triangles"])
                self.assertLessEqual(summary["error_m"], flags.get("--error", np.inf))
                measured = self.check_error(source, self.path("out.obj"), summary["error_m"])
                self.assertGreater(measured, 0.0)

    def test_the_check_of_the_error_finds_one_that_is_too_small(self):
        source = self.bumps()
        self.simplify(source, "out.obj", "--triangles", 100)
        with self.assertRaises(AssertionError):
            self.check_error(source, self.path("out.obj"), 1e-3)

    def test_limits_at_their_ends(self):
        source = self.bumps()
        whole = self.simplify(source, "out.obj", "--triangles", 10**9)
        self.assertEqual((whole["triangles"], whole["vertices"], whole["error_m"], whole["stop"]),
                         (2 * 23 * 23, 24 * 24, 0.0, "triangles"))
        exact = self.simplify(source, "out.obj", "--error", 0)
        self.assertEqual((exact["error_m"], exact["stop"]), (0.0, "error"))
        least = self.simplify(source, "out.obj", "--triangles", 0)
        self.assertEqual(least["stop"], "no_contraction")
        self.assertGreater(least["triangles"], 0)
        self.assertLess(least["triangles"], 20)

    def test_every_format_has_the_same_mesh_and_may_replace_its_input(self):
        source = self.bumps()
        summaries = [self.simplify(source, name, "--triangles", 300) for name in ("a.obj", "a.ply", "a.glb")]
        for summary in summaries:
            for key in ("ms", "out"):
                summary.pop(key)
        self.assertEqual(summaries, summaries[:1] * 3)
        # what was written can be read: the vertices and triangles of both are the same
        self.simplify(self.path("a.ply"), "b.obj", "--triangles", 10**9)
        for made, read in zip(read_obj(self.path("a.obj")), read_obj(self.path("b.obj"))):
            self.assertTrue(np.array_equal(made, read))
        glb = self.simplify(self.path("a.glb"), "c.obj", "--triangles", 10**9)
        self.assertEqual((glb["triangles"], glb["vertices"]), (summaries[0]["triangles"], summaries[0]["vertices"]))
        self.assertLess(np.abs(read_obj(self.path("c.obj"))[0] - read_obj(self.path("a.obj"))[0]).max(), 23 * 2**-23)
        again = run_json("simplify", source, source, "--triangles", 300)
        self.assertEqual(again["triangles"], summaries[0]["triangles"])
        self.assertEqual(len(read_obj(source)[1]), again["triangles"])

    def box(self, name, cells=6):
        """A box with the normal and texture chart of each side at its vertices: corners stand three times."""
        lines, count = [], 0
        for axis in range(3):
            for high in (0, 1):
                first = count + 1
                for j in range(cells + 1):
                    for i in range(cells + 1):
                        point = [0.0] * 3
                        point[axis] = float(cells * high)
                        point[(axis + (1 if high else 2)) % 3], point[(axis + (2 if high else 1)) % 3] = float(i), float(j)
                        normal = [0.0] * 3
                        normal[axis] = 2.0 * high - 1.0
                        lines += ["v %r %r %r" % tuple(point), "vn %r %r %r" % tuple(normal),
                                  "vt %r %r" % (i / cells + 2 * axis, j / cells + 2 * high)]
                        count += 1
                for j in range(cells):
                    for i in range(cells):
                        a = first + j * (cells + 1) + i
                        corners = (a, a + 1, a + cells + 2, a + cells + 1)
                        lines.append("f " + " ".join(f"{c}/{c}/{c}" for c in corners))
        return self.write(name, "\n".join(lines) + "\n")

    def test_attributes_stay_and_seams_stay_closed(self):
        source = self.box("box.obj")
        summary = self.simplify(source, "out.obj", "--triangles", 60)
        self.assertLessEqual(summary["triangles"], 60)
        lines = {kind: [] for kind in ("v", "vn", "vt", "f")}
        with open(self.path("out.obj")) as file:
            for line in file:
                kind, *rest = line.split()
                if kind in lines:
                    lines[kind].append(rest)
        points = [tuple(map(float, point)) for point in lines["v"]]
        normals = np.array(lines["vn"], dtype=float)
        self.assertEqual((len(normals), len(lines["vt"])), (len(points), len(points)))
        edges = {}
        for face in lines["f"]:
            corners = [int(corner.split("/")[0]) - 1 for corner in face]
            self.assertTrue(all(corner.split("/") == [corner.split("/")[0]] * 3 for corner in face))
            a, b, c = (np.array(points[i]) for i in corners)
            normal = np.cross(b - a, c - a)
            for i in corners:
                self.assertGreater(np.dot(normals[i], normal), 0.99 * np.linalg.norm(normal))
            for i, j in zip(corners, corners[1:] + corners[:1]):
                edge = points[i], points[j]
                edges[edge] = edges.get(edge, 0) + 1
        for (i, j), number in edges.items():
            self.assertEqual((number, edges.get((j, i))), (1, 1))
        # PLY has them too, and what it has can be read
        self.simplify(source, "out.ply", "--triangles", 60)
        self.simplify(self.path("out.ply"), "again.obj", "--triangles", 10**9)
        again, first = ([line for line in self.read(name).splitlines() if line.startswith(b"v")]
                        for name in ("again.obj", "out.obj"))
        self.assertEqual(sorted(again), sorted(first))

    def test_area_and_volume_of_a_concave_prism_are_those_of_its_outline_in_every_format(self):
        random = np.random.default_rng(SEED)
        for trial in range(4):
            count = 5 + trial * 9
            angle, radius = 2 * np.pi * np.arange(count) / count, random.integers(2000, 30000, count)
            outline = np.round(np.column_stack([radius * np.cos(angle), radius * np.sin(angle)]))
            height, unit = 7000, 1e-3
            cross = outline[:, 0] * np.roll(outline[:, 1], -1) - outline[:, 1] * np.roll(outline[:, 0], -1)
            base, around = 0.5 * cross.sum(), np.linalg.norm(np.roll(outline, -1, 0) - outline, axis=1).sum()
            expected = (2 * base + around * height) * unit ** 2, base * height * unit ** 3
            points = np.vstack([np.column_stack([outline, np.full(count, z)]) for z in (0, height)])
            after = (np.arange(count) + 1) % count
            faces = [list(range(count))[::-1], list(range(count, 2 * count)),
                     *([i, j, j + count, i + count] for i, j in enumerate(after))]
            # with the two points of the axis, from which the outline is seen all around
            whole = np.vstack([points, [[0, 0, 0], [0, 0, height]]])
            triangles = np.array([triangle for i, j in enumerate(after) for triangle in (
                (2 * count, j, i), (2 * count + 1, i + count, j + count), (i, j, j + count), (i, j + count, i + count))])
            self.write("a.obj", "".join("v %r %r %r\n" % tuple(map(float, p * unit)) for p in points) +
                       "".join("f " + " ".join(str(i + 1) for i in face) + "\n" for face in faces))
            self.write("a.ply", f"ply\nformat binary_big_endian 1.0\nelement vertex {2 * count}\nproperty double x\n"
                       f"property double y\nproperty double z\nelement face {len(faces)}\n"
                       "property list ushort int vertex_indices\nend_header\n".encode() + (points * unit).astype(">f8").tobytes() +
                       b"".join(struct.pack(f">H{len(face)}i", len(face), *face) for face in faces))
            records = np.zeros(len(triangles), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("more", "<u2")])
            records["corners"] = whole[triangles] * unit
            self.write("a.stl", b"solid".ljust(80) + struct.pack("<I", len(triangles)) + records.tobytes())
            positions = np.zeros((len(whole), 4), "<i2")
            positions[:, :3] = whole[:, [0, 2, 1]] * [1, 1, -1]  # y is up
            indices = triangles.astype("<u2")
            binary = positions.tobytes() + indices.tobytes()
            self.write("a.bin", binary)
            self.write("a.gltf", json.dumps({
                "asset": {"version": "2.0"}, "extensionsRequired": ["KHR_mesh_quantization"],
                "buffers": [{"byteLength": len(binary), "uri": "a.bin"}],
                "bufferViews": [{"buffer": 0, "byteLength": positions.nbytes, "byteStride": 8},
                                {"buffer": 0, "byteOffset": positions.nbytes, "byteLength": indices.nbytes}],
                "accessors": [{"bufferView": 0, "componentType": 5122, "count": len(whole), "type": "VEC3"},
                              {"bufferView": 1, "componentType": 5123, "count": indices.size, "type": "SCALAR"}],
                "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
                "nodes": [{"mesh": 0, "scale": [unit] * 3}], "scenes": [{"nodes": [0]}], "scene": 0}))
            for name in ("a.obj", "a.ply", "a.stl", "a.gltf"):
                with self.subTest((trial, name)):
                    self.simplify(self.path(name), "out.obj", "--triangles", 10**9)
                    vertices, read = read_obj(self.path("out.obj"))
                    a, b, c = np.moveaxis(vertices[read], 1, 0)
                    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()
                    volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6
                    np.testing.assert_allclose([area, volume], expected, rtol=1e-6)

    def test_every_method_and_placement_reaches_the_limits_within_its_error(self):
        source = self.bumps()
        for flags in (["--method", "quadric", "--placement", "optimal"], ["--method", "decimation"],
                      ["--method", "clustering"], ["--placement", "endpoint"]):
            with self.subTest(flags):
                summary = self.simplify(source, "out.obj", "--triangles", 200, *flags)
                self.assertLessEqual(summary["triangles"], 200)
                self.assertGreater(summary["triangles"], 100)
                self.assertEqual(summary["stop"], "triangles")
                self.assertGreater(self.check_error(source, self.path("out.obj"), summary["error_m"]), 0.0)
                summary = self.simplify(source, "out.obj", "--error", 0.5, *flags)
                self.assertLessEqual(summary["error_m"], 0.5)
                self.assertLess(summary["triangles"], summary["input_triangles"])
                self.assertEqual(summary["stop"], "error")
                self.check_error(source, self.path("out.obj"), summary["error_m"])

    def test_new_vertices_have_all_attributes_and_may_be_far_from_the_origin(self):
        source = self.box("box.obj")
        for flags in (["--placement", "optimal", "--normal-weight", 1], ["--method", "clustering"],
                      ["--method", "decimation"]):
            with self.subTest(flags):
                summary = self.simplify(source, "out.obj", "--triangles", 60, *flags)
                lines = [line.split()[0] for line in self.read("out.obj").decode().splitlines()]
                for kind in ("v", "vn", "vt"):
                    self.assertEqual(lines.count(kind), summary["vertices"])
                points = [f"v {1e8 + x} {y - 1e8} {z}" for x, y, z in read_obj(source)[0]]
                faces = [" ".join(["f", *(str(i + 1) for i in face)]) for face in read_obj(source)[1]]
                far = self.write("far.obj", "\n".join(points + faces) + "\n")
                summary = self.simplify(far, "out.obj", "--triangles", 60, *flags)
                self.check_error(far, self.path("out.obj"), summary["error_m"] + 1e-6)
        self.assert_all_refused([
            (["simplify", source, self.path("o.obj"), "--triangles", 9, "--method", "quadrik"], "did you mean quadric?"),
            (["simplify", source, self.path("o.obj"), "--triangles", 9, "--method", "clustering", "--placement",
              "optimal"], "--placement goes with --method quadric alone"),
            (["simplify", source, self.path("o.obj"), "--triangles", 9, "--normal-weight", -1], "--normal-weight")], [2])

    def test_attributes_that_a_face_names_and_the_file_has_not(self):
        for number, face in enumerate(("f 1/4 2/1 3/1", "f 1//1 2//1 3//1", "f 1/0 2/1 3/1")):
            name = self.write(f"{number}.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\n" + face + "\n")
            self.assert_refused(run("simplify", name, self.path("out.ply"), "--triangles", 1), [1], name, "line 5")

    def test_real_models(self):
        names = [os.path.join(DATA, "models", name) for name in ("fcl_env.obj", "fcl_rob.obj")]
        if not all(map(os.path.exists, names)):
            self.skipTest("the real models are not there")
        for name in names + [os.path.join(ROOT, "tools", "data", "boulder.obj")]:
            half = self.simplify(name, "out.obj", "--error", 0)["input_triangles"] // 2
            # every count is reached by the one of many parts
            for count in (half, 21, 1) if name == names[0] else (half,):
                with self.subTest((name, count)):
                    summary = self.simplify(name, "out.obj", "--triangles", count)
                    self.assertLessEqual(summary["triangles"], count)
                    self.assertEqual(summary["stop"], "triangles")
                    self.check_error(name, self.path("out.obj"), summary["error_m"])

    def test_text_for_people(self):
        done = run("simplify", self.bumps(), self.path("o.ply"), "--triangles", 100)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertEqual([line.split()[0] for line in done.stdout.splitlines()], KEYS)

    def test_files_that_are_no_mesh(self):
        corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
        header = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
        for name, text in (("empty.obj", ""), ("empty.ply", ""), ("points.obj", corners),
                           ("nan.obj", corners.replace("1", "nan") + "f 1 2 3\n"),
                           ("index.obj", corners + "f 1 2 4\n"), ("foreign.ply", "PK\3\4"),
                           ("cut.ply", header + "end_header\n0 0 0\n"), ("mesh.txt", corners)):
            with self.subTest(name):
                done = run("simplify", self.write(name, text), self.path("out.ply"), "--triangles", 1)
                self.assert_refused(done, [1], name)
        self.assert_all_refused([
            (["simplify", self.path("absent.obj"), self.path("out.ply"), "--triangles", 1], "absent.obj"),
            (["simplify", self.bumps(), self.path("no_folder/o.ply"), "--triangles", 1], "no_folder/o.ply")], [1])
        self.assertFalse(os.path.exists(self.path("out.ply")))


if __name__ == "__main__":
    main()
