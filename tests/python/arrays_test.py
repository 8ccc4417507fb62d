# SPDX-License-Identifier: MIT
"""Arguments and answers as arrays: what is read in place, what is copied, what is refused, and with which words."""
import tracemalloc
import unittest

import numpy as np

import terrane
from grounds import SEED, has, loaded, main, small_fractal


class Arrays(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.terrain = loaded(small_fractal())
        cls.ground = cls.terrain.frame.ground

    def test_contiguous_float64_is_not_copied(self):
        x, y = np.random.default_rng(SEED).uniform(-90, 90, (2, 100_000))
        out = self.ground.heights(x, y)
        tracemalloc.start()
        self.ground.heights(x, y, out=out)
        _, contiguous = tracemalloc.get_traced_memory()
        tracemalloc.reset_peak()
        self.ground.heights(x[::-1], y, out=out)  # copied once: the check of this check
        _, reversed_ = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        self.assertLess(contiguous, 20_000)
        self.assertGreater(reversed_, x.nbytes)

    def test_out_writes_into_the_arrays_that_were_given(self):
        x, y = np.random.default_rng(SEED).uniform(-90, 90, (2, 1000))
        wanted = self.ground.heights(x, y)
        out = self.ground.heights(y, x)
        arrays = [a.ctypes.data for a in out]
        again = self.ground.heights(x, y, out=out)
        self.assertIs(again, out)
        self.assertEqual([a.ctypes.data for a in again], arrays)
        for found, answer in zip(again, wanted):
            np.testing.assert_array_equal(found, answer)

    def test_chunks_are_views(self):
        chunk = self.terrain.resident.chunk(0)
        self.assertTrue(np.shares_memory(chunk.heights, chunk.heights))
        self.assertFalse(chunk.heights.flags.owndata)
        for view in (chunk.heights, chunk.cell_bounds):
            self.assertFalse(view.flags.writeable)
            with self.assertRaises(ValueError):
                view[0, 0] = 1

    def test_other_numbers_are_copied_once_and_answer_the_same(self):
        x, y = np.random.default_rng(SEED).integers(-90, 90, (2, 100)).astype(float)
        wanted = self.ground.heights(x, y).height
        wide = np.zeros((100, 3))
        wide[:, 1] = x
        unaligned = np.frombuffer(b"\0" + x.tobytes(), dtype=np.uint8)[1:].view(float)
        for same in (x.astype(np.float32), x.astype(np.int16), x.tolist(), wide[:, 1], x.astype(">f8"), unaligned,
                     np.asfortranarray(x)):
            np.testing.assert_array_equal(self.ground.heights(same, y).height, wanted)

    def test_other_types_are_a_type_error_that_names_the_argument(self):
        y = np.zeros(3)
        masked = np.ma.array([1.0, 2.0, 3.0], mask=[False, True, False])
        for bad in (None, ["a", "b", "c"], np.ones(3, bool), np.ones(3, complex), [None] * 3, masked,
                    np.array(["2020-01-01"] * 3, dtype="datetime64[D]"), object()):
            with self.assertRaisesRegex(TypeError, "^x must hold real numbers, got [^\n]*$"):
                self.ground.heights(bad, y)

    def test_arguments_that_fit_no_signature_are_a_type_error_of_one_line(self):
        truck = terrane.make_truck()
        for call, words in (
                (lambda: terrane.Lidar([[1, 0, 0]], max_range="far"),
                 r"^__init__\(\) takes Lidar\(.*max_range: float = 100.*\), got \(Lidar, list, max_range=str\)$"),
                (lambda: terrane.World().step(None, np.zeros(2)), r"^step\(\) takes \(.*ground.*, got \(.*ndarray\)$"),
                (lambda: terrane.fractal(sead=7), r"^fractal\(\) takes \(.*seed: int.*got \(sead=int\)$"),
                (lambda: self.ground.heights(np.zeros((30, 30))), r"^heights\(\) takes .*got \(Ground, numpy.ndarray\)$"),
                (lambda: terrane.Shape.sphere("1"), r"^sphere\(\) takes \(.*, got \(str\)$"),
                (lambda: setattr(truck, "mass", "heavy"), r"^a property takes \(.*got \(VehicleSettings, str\)$")):
            with self.assertRaisesRegex(TypeError, words) as caught:
                call()
            self.assertNotIn("\n", str(caught.exception))

    def test_other_shapes_are_a_value_error_that_names_both(self):
        for call, words in (
                (lambda: self.ground.heights(np.zeros(3), np.zeros(4)), r"x and y .* \(3,\) and \(4,\)"),
                (lambda: self.ground.heights(np.zeros((2, 2)), np.zeros(4)), r"\(2, 2\) and \(4,\)"),
                (lambda: self.ground.heights_below(np.zeros(3), np.zeros(3), 1.0), r"x and z .* \(3,\) and \(\)"),
                (lambda: self.ground.rays(np.zeros((3, 2)), np.zeros((3, 3))), r"from_world .*\(n, 3\).*\(3, 2\)"),
                (lambda: self.ground.rays(np.zeros((3, 3)), np.zeros((4, 3))), "from_world has 3 rows, to_world has 4"),
                (lambda: self.ground.rays(np.zeros((1, 1, 3)), np.zeros(3)), r"\(1, 1, 3\)"),
                (lambda: terrane.look_at((0, 0), (1, 0, 0)), r"eye_world .*\(3,\), got \(2,\)"),
                (lambda: terrane.Shape.hull(np.zeros((0, 3))), "point"),
                (lambda: terrane.Shape.hull(np.zeros(3)), r"\(n, 3\)")):
            with self.assertRaisesRegex(ValueError, words) as caught:
                call()
            self.assertNotIn("\n", str(caught.exception))

    def test_an_out_that_does_not_fit_is_refused_before_anything_is_written(self):
        x = np.zeros(4)
        good = self.ground.heights(x, x)
        locked = np.zeros(4)
        locked.setflags(write=False)
        for field, bad, error in (("height", np.zeros(5), ValueError), ("height", np.zeros(4, np.float32), TypeError),
                                  ("normal", np.zeros((3, 4)).T, TypeError), ("status", np.zeros(4, int), TypeError),
                                  ("error_m", locked, ValueError), ("filled", None, TypeError)):
            before = good.height.copy()
            with self.assertRaisesRegex(error, "out." + field):
                self.ground.heights(x + 50, x, out=good._replace(**{field: bad}))
            np.testing.assert_array_equal(good.height, before)

    def test_settings_out_of_range_are_a_value_error_of_one_line(self):
        for call, words in ((lambda: terrane.fractal(octave_count=25), "octave_count .* 25"),
                            (lambda: terrane.fractal(kind="fbn"), 'kind .* ridged.*"fbn"'),
                            (lambda: terrane.fractal(gain=float("nan")), "gain"),
                            (lambda: terrane.Terrain(small_fractal(), worker_count=-1), "worker_count"),
                            (lambda: terrane.Terrain(small_fractal(), policy="none"), "policy"),
                            (lambda: terrane.Terrain(small_fractal(), triangle_budget=1), "triangle_budget"),
                            (lambda: terrane.Shape.sphere(-1.0), "radius"),
                            (lambda: terrane.look_at((0, 0, 0), (0, 0, 0)), "."),
                            (lambda: terrane.Ground(self.terrain.resident, 99), "contact_level .* 99"),
                            (lambda: terrane.World(gravity=(0, 0, np.nan)), "gravity"),
                            (lambda: small_fractal().sample((0, 0), 0, 1), "columns"),
                            (lambda: small_fractal().sample((0, 0), 2, 2, 3), "step")):
            with self.assertRaisesRegex(ValueError, words) as caught:
                call()
            self.assertNotIn("\n", str(caught.exception))
        with self.assertRaises(MemoryError):
            terrane.Terrain(small_fractal(), memory_bytes=1000)
        with self.assertRaises(TypeError):
            terrane.fractal(octaves=3)
        with self.assertRaises(IndexError):
            self.terrain.resident.chunk(10**6)

    def test_files_that_are_not_there_are_an_os_error(self):
        for component, name in (("dem", "open_dem"), ("store", "open_store")):
            if has(component):
                with self.assertRaisesRegex(OSError, "nowhere.tif"):
                    getattr(terrane, name)("/nowhere.tif")
                with self.assertRaises(TypeError):
                    getattr(terrane, name)(3.0)


main()
