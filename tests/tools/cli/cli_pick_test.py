#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""`terrane query` with op pick: pixels of known points, boxes, balls, what is nearest, wrong lines."""

import json

from program import SEED, Folder, ask, main, np


def unit(v):
    return np.asarray(v, float) / np.linalg.norm(v)


def axes(forward, up=(0, 0, 1)):
    """Right, up and forward of a camera."""
    forward = unit(forward)
    right = unit(np.cross(forward, up))
    return right, np.cross(right, forward), forward


def pixel_of(point, eye, camera, fov_deg, size):
    """Where a camera shows a point: from the left and the top edge."""
    right, up, forward = (np.dot(axis, np.subtract(point, eye)) for axis in camera)
    scale = size[1] / 2 / np.tan(np.radians(fov_deg) / 2) / forward
    return [size[0] / 2 + right * scale, size[1] / 2 - up * scale]


def rotation_of(quaternion):
    w, x, y, z = quaternion
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])


def meet_box(eye, direction, low, high):
    """Distance at which a ray enters a box; infinity: never. By slabs."""
    with np.errstate(divide="ignore"):
        a, b = (low - eye) / direction, (high - eye) / direction
    enter, leave = np.minimum(a, b).max(), np.maximum(a, b).min()
    return enter if 0 <= enter <= leave else np.inf


def meet_ball(eye, direction, centre, radius):
    along = np.dot(centre - eye, direction)
    rest = radius ** 2 - np.sum((centre - eye) ** 2) + along ** 2
    return along - np.sqrt(rest) if rest >= 0 and along >= np.sqrt(rest) else np.inf


class Pick(Folder):
    SIZE = [640, 360]

    def scene(self, **more):
        return ["--scene", super().scene(**more)]

    def flat(self, height=100.0):
        """600 m by 600 m."""
        return self.write_grid("flat.asc", np.full((60, 60), height))

    def pick(self, eye, pixel, **more):
        return {"op": "pick", "eye": list(map(float, eye)), "size": self.SIZE, "pixel": list(map(float, pixel)), **more}

    def test_the_pixel_of_a_point_of_the_ground_is_that_point(self):
        _, raster = self.hills()
        random = np.random.default_rng(SEED)
        places = random.uniform(-150, 150, (200, 2))
        heights = [a["height"] for a in ask(["--dem", raster], [{"op": "height", "x": x, "y": y} for x, y in places])]
        points = np.column_stack([places, heights])
        questions = []
        for point in points:
            # steeper than the ground, so that nothing hides the point
            eye = point + [*random.uniform(-100, 100, 2), 500]
            fov = random.uniform(20, 150)
            camera = axes(point + random.uniform(-30, 30, 3) - eye)
            questions.append(self.pick(eye, pixel_of(point, eye, camera, fov, self.SIZE), forward=list(3 * camera[2]),
                                       fov_deg=fov))
        for question, point, answer in zip(questions, points, ask(["--dem", raster], questions), strict=True):
            self.assertEqual((answer["status"], answer["hit"], answer["kind"]), ("ok", True, "ground"), question)
            np.testing.assert_allclose(answer["point"], point, atol=1e-6, err_msg=f"seed {SEED}, {question}")
            self.assertAlmostEqual(answer["distance"], np.linalg.norm(point - question["eye"]), places=6)
            self.assertGreater(answer["normal"][2], 0)
            self.assertGreaterEqual(answer["error_m"], 0)

    def test_the_nearest_of_ground_boxes_and_balls_is_picked(self):
        random = np.random.default_rng(SEED)
        mesh = self.write_block()
        objects, bodies, far = [], [], 120.0
        for _ in range(12):
            objects.append({"mesh": mesh, "position": [*random.uniform(-60, 60, 2), random.uniform(95, 120)],
                            "rotation": list(unit(random.normal(size=4))), "scale": random.uniform(0.5, 3)})
            bodies.append({"shape": {"sphere": {"radius": random.uniform(0.5, 6)}},
                           "position": [*random.uniform(-60, 60, 2), random.uniform(95, 120)]})
        # a scatter in the list, too thin to have an object here: entries keep their numbers
        objects.insert(3, {"scatter": {"mesh": mesh, "per_km2": 1e-6}})
        scene = self.scene(dem=self.flat(), objects=objects, bodies=bodies)
        questions, rays, wanted = [], [], []
        for _ in range(1500):
            eye = np.array([*random.uniform(-100, 100, 2), random.uniform(101, 160)])
            aim = (objects + bodies)[random.integers(25)].get("position", [0, 0, 95])
            look = np.array(aim) + random.uniform(-5, 5, 3)
            share = 0.1 if random.random() < 0.7 else 0.5
            pixel = random.uniform(0.5 - share, 0.5 + share, 2) * self.SIZE
            right, up, forward = axes(look - eye)
            scale = self.SIZE[1] / 2 / np.tan(np.radians(30))
            direction = unit(forward * scale + right * (pixel[0] - 320) - up * (pixel[1] - 180))
            distances = {("ground", None): (100 - eye[2]) / direction[2] if direction[2] < 0 else np.inf}
            for i, each in enumerate(objects):
                if "scatter" in each:
                    continue
                back = rotation_of(each["rotation"]).T / each["scale"]
                distances["object", i] = meet_box(back @ (eye - each["position"]), back @ direction,
                                                  np.array([-2, -1, 0]), np.array([2, 1, 3]))
            for i, each in enumerate(bodies):
                distances["body", i] = meet_ball(eye, direction, np.array(each["position"]),
                                                 each["shape"]["sphere"]["radius"])
            inside = any(np.linalg.norm(eye - each["position"]) < 9.5
                         for each in objects + bodies if "position" in each)
            first, second = sorted(distances.values())[:2]
            beside = max(abs(eye + min(first, far) * direction)[:2]) > 290
            if inside or beside or second - first < 1e-6 or abs(first - far) < 1e-6:
                continue
            questions.append(self.pick(eye, pixel, look=list(look), far_m=far))
            rays.append({"op": "ray", "from": list(eye), "to": list(eye + far * direction)})
            wanted.append((min(distances, key=distances.get), first, eye + first * direction))
        kinds = {}
        answers = ask(scene, questions + rays)
        for question, ((kind, index), distance, point), answer, ray in zip(
                questions, wanted, answers[:len(questions)], answers[len(questions):], strict=True):
            message = f"seed {SEED}, {question}, {answer}"
            if distance > far:
                self.assertEqual(answer, {"status": "miss", "hit": False, "kind": "none"}, message)
                self.assertEqual(ray, {"status": "miss", "hit": False}, message)
                kind = "none"
            else:
                self.assertAlmostEqual(ray.pop("fraction") * far, answer["distance"], places=6, msg=message)
                for key in ("point", "normal"):
                    np.testing.assert_allclose(ray.pop(key), answer[key], atol=1e-6, err_msg=message)
                self.assertEqual(ray, {key: answer[key] for key in ray}, message)
                self.assertEqual(set(answer) - set(ray), {"distance", "point", "normal"}, message)
                self.assertEqual((answer["status"], answer["kind"]), ("ok", kind), message)
                self.assertAlmostEqual(answer["distance"], distance, places=6, msg=message)
                np.testing.assert_allclose(answer["point"], point, atol=1e-6, err_msg=message)
                self.assertAlmostEqual(np.linalg.norm(answer["normal"]), 1, places=9)
            if kind == "object":
                self.assertEqual((answer["object"], answer["mesh"]), (index, mesh), message)
                self.assertNotIn("square", answer)
            if kind == "body":
                self.assertEqual(answer["body"], index, message)
            kinds[kind] = kinds.get(kind, 0) + 1
        self.assertGreater(min(kinds[kind] for kind in ("ground", "object", "body", "none")), 50, kinds)

    def test_of_objects_in_one_place_the_first_one_is_picked_and_ground_before_all(self):
        mesh = self.write_block()
        block = {"mesh": mesh, "position": [5, 5, 100]}
        above = self.pick([5.5, 5.25, 200], [320, 180], forward=[0, 0, -1])
        answer, = ask(self.scene(dem=self.flat(), objects=[block, block, block]), [above])
        self.assertEqual((answer["kind"], answer["object"]), ("object", 0))
        self.assertAlmostEqual(answer["distance"], 97)
        # its top is the ground
        sunk = {**block, "position": [5, 5, 97]}
        answer, = ask(self.scene(dem=self.flat(), objects=[sunk]), [above])
        self.assertEqual(answer["kind"], "ground")

    def test_scattered_objects_are_picked_with_their_square_and_index(self):
        mesh = self.write_block()
        scene = self.scene(dem=self.flat(), objects=[{"mesh": mesh, "position": [0, 0, 500]},
                                                     {"scatter": {"mesh": mesh, "per_km2": 20000, "scale": [0.5, 2]}}])
        questions = [self.pick([x, y, 300], [320, 180], forward=[0, 0, -1])
                     for x in np.arange(-50, 50, 2.1) for y in np.arange(-50, 50, 2.1)]
        seen = {}
        for question, answer in zip(questions, ask(scene, questions), strict=True):
            if answer["kind"] == "ground":
                continue
            self.assertEqual((answer["kind"], answer["object"], answer["mesh"]), ("object", 1, mesh))
            self.assertAlmostEqual(answer["point"][2], 100 + 3 * answer["scale"], places=6)
            np.testing.assert_allclose(answer["normal"], [0, 0, 1], atol=1e-9)
            beside = np.linalg.norm(np.subtract(answer["point"], answer["position"])[:2])
            self.assertLessEqual(beside, np.sqrt(5) * answer["scale"] + 1e-9)
            name = (*answer["square"], answer["index"])
            self.assertEqual(seen.setdefault(name, answer["position"]), answer["position"])
        self.assertGreater(len(seen), 50)
        # the same answers in another order
        again = ask(scene, questions[::-97])
        self.assertEqual(again, ask(scene, questions)[::-97])

    def test_straight_down_is_north_up_and_up_turns_the_picture(self):
        terrain = ["--dem", self.flat(0.0)]
        eye, half = [3, 4, 50], 50 * np.tan(np.radians(30))
        top, right, turned, centre = ask(terrain, [
            self.pick(eye, [320, 0], forward=[0, 0, -1]), self.pick(eye, [320 + 180, 180], look=[3, 4, 0]),
            self.pick(eye, [320, 0], forward=[0, 0, -7], up=[5, 0, 1]),
            self.pick(eye, [320, 180], forward=[0, 0, -1], fov_deg=0.1)])
        np.testing.assert_allclose(top["point"], [3, 4 + half, 0], atol=1e-9)
        np.testing.assert_allclose(right["point"], [3 + half, 4, 0], atol=1e-9)
        np.testing.assert_allclose(turned["point"], [3 + half, 4, 0], atol=1e-9)
        np.testing.assert_allclose(centre["point"], [3, 4, 0], atol=1e-9)

    def test_narrow_and_wide_fields_of_view(self):
        terrain = ["--dem", self.flat(0.0)]
        for fov in (0.1, 179):
            half = np.tan(np.radians(fov / 2))
            height = min(50, 200 / half)
            answer, = ask(terrain, [self.pick([0, 0, height], [320, 90], forward=[0, 0, -1], fov_deg=fov)])
            self.assertEqual(answer["status"], "ok")
            np.testing.assert_allclose(answer["point"], [0, height * half / 2, 0], atol=1e-7)

    def test_from_below_the_ground_its_underside_is_picked(self):
        up, down = ask(["--dem", self.flat()], [self.pick([1, 2, 40], [320, 180], forward=[0, 0, 1]),
                                                self.pick([1, 2, 40], [320, 180], forward=[0, 0, -1])])
        self.assertEqual((up["status"], up["kind"]), ("ok", "ground"))
        self.assertAlmostEqual(up["distance"], 60)
        self.assertEqual(down, {"status": "miss", "hit": False, "kind": "none"})

    def test_ground_that_does_not_fit_into_memory_is_not_resident(self):
        answer, = ask(["--seed", 7], [self.pick([0, 0, 2000], [320, 180], forward=[1, 0, -1])], "--memory-mb", 1.5)
        self.assertEqual(answer, {"status": "not_resident"})

    def test_wrong_lines_are_invalid_and_name_what_is_wrong(self):
        good = self.pick([0, 0, 200], [320, 180], forward=[0, 0, -1])
        wrong = [({"pixel": [-0.1, 0]}, "pixel"), ({"pixel": [0, 360.5]}, "pixel"), ({"pixel": [1]}, "pixel"),
                 ({"size": [0, 360]}, "size"), ({"size": [640.5, 360]}, "size"), ({"fov_deg": 0.05}, "0.05"),
                 ({"fov_deg": 180}, "180"), ({"far_m": 0}, "far_m"), ({"far_m": 1e10}, "1e+10"),
                 ({"forward": [0, 0, 0]}, "forward"), ({"up": [0, 0, 3]}, "up"), ({"look": [0, 0, 0]}, "exclude"),
                 ({"eye": [0, 0, 1e10]}, "eye"), ({"eye": "here"}, "eye"), ({"other": {}}, "other")]
        lines = [{**good, **values} for values, _ in wrong]
        lines += [{k: v for k, v in good.items() if k != key} for key in ("eye", "forward", "size", "pixel")]
        lines += [json.dumps(good).replace("320.0", text) for text in ("NaN", "1e999")]
        words = [word for _, word in wrong] + ["eye", "look", "size", "pixel", "", ""]
        edges = [{**good, "pixel": pixel} for pixel in ([0, 0], [640, 360])]
        answers = ask(["--dem", self.flat()], lines + edges)
        for line, word, answer in zip(lines, words, answers):
            self.assertEqual(answer["status"], "invalid", line)
            self.assertIn(word, answer["message"], line)
        self.assertEqual([a["status"] for a in answers[len(lines):]], ["ok", "ok"])


if __name__ == "__main__":
    main()
