# SPDX-License-Identifier: MIT
"""Long calls let other threads of Python go on; objects of one thread at a time notice a second one."""
import tempfile
import threading
import unittest

import numpy as np

import terrane
from grounds import SEED, has, loaded, main, small_fractal


class Counter:
    """Counts in another thread of Python while a call runs. A call that kept the lock would leave it at 0 or 1."""

    def during(self, call):
        count, running, stop = [0], threading.Event(), threading.Event()

        def work():
            running.set()
            while not stop.is_set():
                count[0] += 1

        thread = threading.Thread(target=work)
        thread.start()
        running.wait()
        before = count[0]
        call()
        after = count[0]
        stop.set()
        thread.join()
        return after - before


class Lock(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.source = small_fractal()
        cls.terrain = loaded(cls.source)
        cls.ground = cls.terrain.frame.ground

    def check(self, call):
        call()  # first use
        # A held lock can still let the other thread run for one turn before or after the call.
        self.assertTrue(any(Counter().during(call) > 300 for _ in range(3)))

    def test_a_call_that_keeps_the_lock_stops_the_counter(self):  # the check of the check
        big = 7**200_000
        counts = [Counter().during(lambda: big * big) for _ in range(3)]
        free = Counter().during(lambda: threading.Event().wait(0.2))
        self.assertLess(min(counts), free)

    def test_batches_of_the_ground_let_others_run(self):
        x, y = np.random.default_rng(SEED).uniform(-90, 90, (2, 200_000))
        self.check(lambda: self.ground.heights(x, y))
        start, end = (np.column_stack([x[:50_000], y[:50_000], np.full(50_000, z)]) for z in (500.0, -500.0))
        self.check(lambda: self.ground.rays(start, end))
        near = start[:1000].copy()
        near[:, 2] = self.ground.heights(x[:1000], y[:1000]).height + 0.2
        box = terrane.Shape.box((0.5, 0.4, 0.3))
        self.check(lambda: self.ground.contacts(box, near))
        self.check(lambda: self.ground.distances(box, near[:200]))
        self.check(lambda: self.source.heights(x[:50_000], y[:50_000]))

    def test_steps_loads_and_meshes_let_others_run(self):
        world = terrane.World()
        xy = np.random.default_rng(SEED).uniform(-60, 60, (300, 2))
        top = self.ground.heights(*np.ascontiguousarray(xy.T)).height
        world.add(terrane.Shape.box((0.4, 0.4, 0.4)), np.column_stack([xy, top + 1]))

        def steps():
            for _ in range(10):
                world.step(self.ground, 1 / 30)

        self.check(steps)
        self.check(lambda: loaded(small_fractal(seed=9)))
        view = terrane.look_at((-300, -300, 150), (0, 0, 0))
        terrain = loaded(self.source, max_error_px=0.1)
        self.check(lambda: terrain.load([terrane.Camera(view)], None, 0.0).meshes[0].vertices)
        if has("store"):
            small = small_fractal(root_size_log2=8, root_count=(1, 1), first_root=(0, 0))
            with tempfile.TemporaryDirectory() as folder:
                self.check(lambda: terrane.bake(small, folder + "/a.store"))
                self.check(lambda: terrane.ShardBaker(small, tempfile.mkdtemp(dir=folder)).bake_shard(0))

    def test_a_ground_answers_the_same_on_many_threads(self):
        x, y = np.random.default_rng(SEED).uniform(-90, 90, (2, 50_000))
        wanted = self.ground.heights(x, y)
        found = [None] * 4

        def ask(i):
            found[i] = self.ground.heights(x, y)

        threads = [threading.Thread(target=ask, args=(i,)) for i in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        for answer in found:
            for ours, theirs in zip(answer, wanted):
                np.testing.assert_array_equal(ours, theirs)

    def test_a_second_thread_in_a_world_is_a_runtime_error_and_harms_nothing(self):
        def make():
            world = terrane.World()
            xy = np.random.default_rng(SEED).uniform(-30, 30, (300, 2))
            world.add(terrane.Shape.box((0.4, 0.4, 0.4)), np.column_stack([xy, np.full(300, 80.0)]))
            return world

        world, alone = make(), make()
        refused, stop = [], threading.Event()

        def disturb():
            while not stop.is_set():
                try:
                    world.needs()
                except RuntimeError as error:
                    refused.append(str(error))

        thread = threading.Thread(target=disturb)
        thread.start()
        stepped = 0
        while stepped < 40 or not refused:
            try:
                world.step(self.ground, 1 / 30)
                stepped += 1
            except RuntimeError:  # the other thread was inside
                pass
        stop.set()
        thread.join()
        self.assertEqual(set(refused), {"this World is in use by another thread"})
        for _ in range(stepped):
            alone.step(self.ground, 1 / 30)
        self.assertEqual(world.state_hash, alone.state_hash)


main()
