#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Shards of a terrain that many processes bake: ranks of MPI and Slurm, and jobs of Slurm.

    cli_jobs_test.py PROGRAM [Ranks|Scripts|Slurm|Pieces]

Slurm starts a cluster of one node on this machine, with Debian's slurm-wlm. tools/setup does not install it, because its
daemons then run as services.
"""

import glob
import hashlib
import json
import os
import pwd
import shutil
import signal
import socket
import subprocess
import sys
import time
import unittest
from random import Random

import numpy as np

from program import PROGRAM, Folder, run, run_json

VARIABLES = ["OMPI_COMM_WORLD_RANK", "OMPI_COMM_WORLD_SIZE", "SLURM_PROCID", "SLURM_NTASKS"]


class Shards(Folder):
    def setUp(self):
        super().setUp()
        _, raster = self.hills(900, 300)
        self.terrain = ["--dem", raster, "--detail-m", 5]  # 8 shards
        self.out = self.path("out")

    def files(self, folder):
        """Hashes of the files of a baked terrain."""
        found = {}
        for path in glob.glob(f"{folder}/**", recursive=True):
            if os.path.isfile(path) and not path.endswith(".sbatch"):
                with open(path, "rb") as file:
                    found[os.path.relpath(path, folder)] = hashlib.sha256(file.read()).hexdigest()
        return found

    def assert_whole(self):
        """The folder has the files that one process bakes."""
        run_json("bake", *self.terrain, "--out", self.path("whole"), "--sharded")
        self.assertEqual(self.files(self.out), self.files(self.path("whole")))


class Pieces(Shards):
    """1, 7 and 64 pieces by one process or two at a time, of which ten are killed."""

    PIECES_AND_WORKERS = ((1, 1), (7, 2), (64, 1), (64, 2))
    KILLS = 10
    SEED = 64

    def setUp(self):
        super().setUp()
        # Shards are 4096 points wide, and the world is square: a strip has many of them for its size.
        columns, rows = 56_000, 8
        x, y = np.arange(columns, dtype=np.float32), np.arange(rows, dtype=np.float32)[:, None]
        random = np.random.default_rng(self.SEED)
        heights = 500 + 40 * np.sin(x / 5) * np.cos(y / 7) + random.uniform(0, 5, (rows, columns))
        heights.astype("<f4").tofile(self.path("strip.bil"))
        with open(self.path("strip.hdr"), "w") as file:
            file.write(f"ncols {columns}\nnrows {rows}\nnbits 32\npixeltype float\nbyteorder I\nxdim 10\nydim 10\nulxmap 0\nulymap 0\n")
        self.terrain = ["--dem", self.path("strip.bil")]

    def start(self, out, shards):
        return subprocess.Popen([PROGRAM, "bake", *map(str, self.terrain), "--out", out, "--shard", ",".join(map(str, shards)), "--threads", "1"],
                                stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)

    def bake_pieces(self, out, count, workers, kills, random):
        """Bakes the pieces with some processes at a time, in a random order. Returns the number of processes that were killed at work."""
        shards = run_json("bake", *self.terrain, "--out", out, "--plan")["shards"]
        self.assertGreaterEqual(shards, 64)
        waiting = [range(piece, shards, count) for piece in range(count)]
        random.shuffle(waiting)
        running, killed = [], 0
        while waiting or running:
            while waiting and len(running) < workers:
                piece = waiting.pop()
                running.append((piece, self.start(out, piece)))
            if killed < kills and random.random() < 0.5:
                time.sleep(random.uniform(0.0, 0.1))
                running[random.randrange(len(running))][1].kill()
            piece, process = running.pop(0)
            message = process.communicate(timeout=600)[1].decode()
            if process.returncode == -signal.SIGKILL:
                killed += 1
                waiting.insert(0, piece)
            else:
                self.assertEqual((process.returncode, message), (0, ""))
        run_json("bake", "--out", out, "--combine")
        for path in glob.glob(f"{out}/**/*.partial-*", recursive=True):  # of the killed processes
            os.remove(path)
        return killed

    def test_have_the_same_bytes(self):
        random = Random(self.SEED)
        print(f"seed {self.SEED}")
        wanted = None
        for count, workers in self.PIECES_AND_WORKERS:
            kills = self.KILLS if count > self.KILLS else 0
            out = self.path(f"{count}-{workers}")
            self.assertEqual(self.bake_pieces(out, count, workers, kills, random), kills)
            found = self.files(out)
            wanted = wanted or found
            self.assertEqual(found, wanted, f"{count} pieces, {workers} at a time")
            shutil.rmtree(out)


class Ranks(Shards):
    def bake_mine(self, *values, arguments=()):
        """Bakes with VARIABLES of these values, where they have any."""
        environment = {name: value for name, value in os.environ.items() if name not in VARIABLES}
        environment.update({name: str(value) for name, value in zip(VARIABLES, values) if value is not None})
        return subprocess.run([PROGRAM, "bake", *map(str, self.terrain), "--out", self.out, "--shard", "mine", "--json", *arguments],
                              capture_output=True, text=True, timeout=120, env=environment)

    def test_processes_bake_every_shard_once(self):
        # of Slurm, of Open MPI, and of Open MPI in a job of Slurm, whose variables are then not those of the rank
        for rank, values in ((2, (None, None, 2, 3)), (0, (0, 3)), (1, (1, 3, 0, 7))):
            done = json.loads(self.bake_mine(*values).stdout)
            self.assertEqual([done[key] for key in ("shards", "rank", "ranks", "baked", "found")], [8, rank, 3, (3, 3, 2)[rank], 0])
        more = json.loads(self.bake_mine(8, 9).stdout)  # ranks than shards
        self.assertEqual((more["baked"], more["found"]), (0, 0))
        run_json("bake", "--out", self.out, "--combine")
        self.assert_whole()

    def test_ranks_that_make_no_sense_are_refused_by_name(self):
        for values, words in (
                ((), (*VARIABLES, "--shard mine")), ((1,), ("OMPI_COMM_WORLD_RANK is set, but not OMPI_COMM_WORLD_SIZE",)),
                ((None, 2), ("OMPI_COMM_WORLD_SIZE is set, but not OMPI_COMM_WORLD_RANK",)),
                ((None, None, 1), ("SLURM_PROCID is set, but not SLURM_NTASKS",)), ((1, None, 1, 2), ("OMPI_COMM_WORLD_SIZE",)),
                ((3, 3), ("OMPI_COMM_WORLD_RANK must be 0 to 2, got '3'",)), ((-1, 3), ("OMPI_COMM_WORLD_RANK", "'-1'")),
                ((0, 0), ("OMPI_COMM_WORLD_SIZE", "'0'")), (("", 2), ("OMPI_COMM_WORLD_RANK", "''")),
                ((None, None, "1.5", 2), ("SLURM_PROCID", "'1.5'")), ((None, None, 0, "2(x3)"), ("SLURM_NTASKS", "'2(x3)'")),
                ((0, 2**64), ("OMPI_COMM_WORLD_SIZE", 2**64))):
            with self.subTest(values):
                self.assert_refused(self.bake_mine(*values), [1], *words)
        self.assertFalse(os.path.exists(self.out))

    def test_flags_that_do_not_go_with_it_are_refused(self):
        for flag in ("--combine", "--sharded", "--verify"):
            self.assert_refused(self.bake_mine(0, 2, arguments=[flag]), [2], "--shard mine")
        bake = ["bake", *self.terrain, "--out", self.out]
        self.assert_all_refused([
            ([*bake, "--shard", "1,x"], "--shard", "mine", "'1,x'"), ([*bake, "--shard", "yours"], "'yours'"),
            ([*bake, "--shard", "1,mine"], "'1,mine'"), ([*bake, "--shard", ""], "--shard"), ([*bake, "--shard", "-1"], "'-1'"),
            ([*bake, "--shard", "1,,2"], "'1,,2'"), ([*bake, "--shard", 2**64], 2**64)], [2])

    @unittest.skipUnless(shutil.which("mpirun"), "mpirun, Debian's openmpi-bin, was not found")
    def test_mpirun_gives_the_ranks(self):
        names = [name for name in os.environ if name.startswith(("OMPI_", "PMIX_", "SLURM_"))]
        environment = {**{name: value for name, value in os.environ.items() if name not in names},
                       "OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
        done = subprocess.run(["mpirun", "--oversubscribe", "-n", "3", PROGRAM, "bake", *map(str, self.terrain), "--out", self.out,
                               "--shard", "mine", "--threads", "1", "--json"], capture_output=True, text=True, timeout=200,
                              env=environment)
        self.assertEqual(done.returncode, 0, done.stderr)
        ranks = [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]
        self.assertEqual(sorted((each["rank"], each["ranks"], each["baked"]) for each in ranks), [(0, 3, 3), (1, 3, 3), (2, 3, 2)])
        run_json("bake", "--out", self.out, "--combine")
        self.assert_whole()


class Jobs(Shards):
    def write_scripts(self, *arguments, out="out"):
        # in the program itself, whose path the scripts have
        done = run("bake", *self.terrain, *arguments, "--out", self.path(out), "--slurm", "--json", alone=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(done.stdout)


class Scripts(Jobs):
    def run_job(self, script, number, **environment):
        return subprocess.run(["sh", script], capture_output=True, text=True, cwd="/",
                              env={**os.environ, "SLURM_ARRAY_TASK_ID": str(number), **environment})

    def test_jobs_of_the_scripts_bake_every_shard_and_combine_them(self):
        self.out = self.path("it's \"$HOME\" `x`")
        summary = self.write_scripts("--region", "-4500,-1500,0,1000", "--nodata", "-7,-8", out=os.path.basename(self.out))
        self.assertEqual(summary["scripts"], [f"{self.out}/bake.sbatch", f"{self.out}/combine.sbatch"])
        self.terrain += ["--region", "-4500,-1500,0,1000", "--nodata", "-7,-8"]
        bake, combine = summary["scripts"]
        self.assertIn(f"\n#SBATCH --array=0-{summary['jobs'] - 1}\n", self.read(bake).decode())
        self.assertEqual(self.run_job(combine, 0).returncode, 1)  # too early
        for job in range(summary["jobs"]):
            done = self.run_job(bake, job)
            self.assertEqual(done.returncode, 0, done.stderr)
        done = self.run_job(combine, 0)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assert_whole()

    def test_an_array_has_at_most_1000_jobs_that_share_all_shards(self):
        self.terrain = ["--seed", 1, "--world-m", 131072, "--detail-m", 0.5]
        summary = self.write_scripts("--threads", 3)
        self.assertGreater(summary["shards"], 1000)
        self.assertEqual(summary["jobs"], 1000)
        text = self.read(summary["scripts"][0]).decode()
        self.assertIn("\n#SBATCH --array=0-999\n", text)
        self.assertIn("\n#SBATCH --cpus-per-task=3\n", text)
        self.assertIn(" --threads=3 ", text)
        # the same script, which prints the shards in place of baking them
        script = self.write("print.sh", "\n".join(line for line in text.splitlines() if not line.startswith("exec ")) +
                            "\nseq \"$first\" \"$last\"\n")
        shards = [int(word) for job in (0, 1, 500, 999) for word in self.run_job(script, job).stdout.split()]
        count = summary["shards"]
        self.assertEqual(shards, [shard for job in (0, 1, 500, 999) for shard in range(job * count // 1000, (job + 1) * count // 1000)])
        self.assertEqual((shards[0], shards[-1]), (0, count - 1))

    def test_flags_that_do_not_go_with_it_are_refused(self):
        self.assert_all_refused([(["bake", *self.terrain, "--out", self.out, "--slurm", *flags], flags[0]) for flags in (
            ["--sharded"], ["--combine"], ["--verify"], ["--shard", "1"], ["--shard", "mine"])], [2])


class Slurm(Jobs):
    """A cluster of one node, with its own files, ports and key."""

    def setUp(self):
        super().setUp()
        for name in ("munged", "slurmctld", "slurmd"):
            if not shutil.which(name, path=os.environ["PATH"] + ":/usr/sbin"):
                self.skipTest(f"{name} of Debian's slurm-wlm was not found")
        self.home = self.path("slurm")
        for name in ("state", "spool"):
            os.makedirs(os.path.join(self.home, name))
        os.chmod(self.folder, 0o755)  # for munged
        key = os.path.join(self.home, "key")
        with open(os.open(key, os.O_WRONLY | os.O_CREAT, 0o400), "wb") as file:
            file.write(os.urandom(1024))
        host = socket.gethostname().split(".")[0]
        ports = [socket.create_server(("127.0.0.1", 0)) for _ in range(2)]
        numbers = [each.getsockname()[1] for each in ports]
        for each in ports:
            each.close()
        user = pwd.getpwuid(os.getuid()).pw_name
        config = self.write("slurm/slurm.conf", f"""\
ClusterName=terrane
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={numbers[0]}
SlurmdPort={numbers[1]}
SlurmUser={user}
SlurmdUser={user}
AuthType=auth/munge
AuthInfo=socket={self.home}/munge.socket
StateSaveLocation={self.home}/state
SlurmdSpoolDir={self.home}/spool
SlurmctldPidFile={self.home}/slurmctld.pid
SlurmdPidFile={self.home}/slurmd.pid
SlurmctldLogFile={self.home}/slurmctld.log
SlurmdLogFile={self.home}/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
MpiDefault=none
NodeName={host} NodeAddr=127.0.0.1 CPUs=2
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
""")
        names = [name for name in os.environ if name.startswith("SLURM")]
        self.environment = {**{name: value for name, value in os.environ.items() if name not in names}, "SLURM_CONF": config,
                            "PATH": os.environ["PATH"] + ":/usr/sbin"}
        self.begin("munged", "--foreground", "--force", f"--key-file={key}", f"--socket={self.home}/munge.socket",
                   f"--pid-file={self.home}/munge.pid", f"--log-file={self.home}/munge.log", f"--seed-file={self.home}/munge.seed")
        self.wait_for("munged", lambda: os.path.exists(f"{self.home}/munge.socket"))
        self.begin("slurmctld", "-D")
        self.begin("slurmd", "-D")
        self.wait_for("slurmd", lambda: "idle" in self.ask("sinfo", "--noheader"))

    def begin(self, *words):
        with open(f"{self.home}/{words[0]}.out", "wb") as log:
            process = subprocess.Popen(words, stdin=subprocess.DEVNULL, stdout=log, stderr=log, env=self.environment, cwd=self.home)

        def end():
            process.terminate()
            try:
                process.wait(20)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()

        self.addCleanup(end)

    def wait_for(self, what, is_there):
        """Where Slurm cannot run, as in some containers, the test is skipped."""
        deadline = time.monotonic() + 30
        while not is_there():
            if time.monotonic() > deadline:
                logs = [self.read(path).decode(errors="replace").strip() for path in glob.glob(f"{self.home}/*.out")]
                self.skipTest(f"{what} does not start here: " + " | ".join(log.splitlines()[-1] for log in logs if log))
            time.sleep(0.1)

    def ask(self, *words):
        """What a command of Slurm prints; "" if it fails."""
        done = subprocess.run(words, capture_output=True, text=True, env=self.environment, timeout=60, cwd=self.folder)
        return done.stdout if done.returncode == 0 else ""

    def submit(self, line):
        done = subprocess.run(["sh", "-c", line], capture_output=True, text=True, env=self.environment, timeout=60, cwd=self.folder)
        self.assertEqual(done.returncode, 0, done.stderr)
        deadline = time.monotonic() + 200
        while self.ask("squeue", "--noheader") and time.monotonic() < deadline:
            time.sleep(0.2)

    def states(self):
        """States in which jobs have ended."""
        words = self.ask("scontrol", "show", "job").split()
        return {word.split("=")[1] for word in words if word.startswith("JobState=")}

    def test_the_line_of_the_summary_bakes_the_terrain(self):
        summary = self.write_scripts()
        self.submit(summary["submit"])
        self.assertEqual(self.states(), {"COMPLETED"})
        self.assert_whole()

    def test_a_job_that_fails_is_submitted_again(self):
        summary = self.write_scripts()
        raster = self.terrain[1]
        os.rename(raster, raster + ".away")
        self.submit(summary["submit"])
        self.assertEqual(self.states(), {"FAILED", "CANCELLED"})  # the array, and what depends on it
        self.assertFalse(os.path.exists(f"{self.out}/terrain.json"))
        os.rename(raster + ".away", raster)
        self.submit(summary["submit"])
        self.assert_whole()

    def test_srun_gives_the_ranks(self):
        words = ["bake", *map(str, self.terrain), "--out", self.out, "--shard", "mine", "--threads", "1", "--json"]
        done = subprocess.run(["srun", "-n", "2", PROGRAM, *words], capture_output=True, text=True, env=self.environment, timeout=200)
        self.assertEqual(done.returncode, 0, done.stderr)
        ranks = [json.loads(line) for line in done.stdout.splitlines()]
        self.assertEqual(sorted((each["rank"], each["ranks"], each["baked"]) for each in ranks), [(0, 2, 4), (1, 2, 4)])
        run_json("bake", "--out", self.out, "--combine")
        self.assert_whole()


if __name__ == "__main__":
    result = unittest.main(argv=[sys.argv[0], *sys.argv[2:]], exit=False).result
    if result.testsRun == len(result.skipped):
        sys.exit(77)
    sys.exit(0 if result.wasSuccessful() else 1)
