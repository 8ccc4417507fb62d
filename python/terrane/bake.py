# SPDX-License-Identifier: MIT
"""Bakes a raster in shards on Dask: `python3 -m terrane.bake SOURCE DEST`, or submit() in a program.

The graph has a task that plans the shards, a task for each shard, and one that depends on all of them and combines them. A
shard's task is a function of the source, the settings and the shard's number. Processes share the folder and nothing
else. Scheduling, retries, lost workers and the dashboard are those of Dask distributed, Debian's python3-distributed.

The module can be called: terrane.bake(source, path, ...) bakes one file, without Dask.
"""
import argparse
import json
import math
import os
import re
import signal
import sys
import tempfile
import threading
import time
import types
from typing import Any, Callable, Dict, List, NamedTuple, Optional, Sequence, TextIO, Tuple

from . import _terrane

RETRIES = 3  # of a task that fails, by Dask
ANSWER_SECONDS = 10.0  # within which a scheduler must answer
LINE_SECONDS = 30.0  # between lines of progress, if standard error is not a terminal


class Job(NamedTuple):
    """A raster, a folder for its shards, and settings."""
    source: str
    folder: str
    dem: Tuple[Tuple[str, Any], ...]  # arguments of open_dem()
    level_count: int  # as those of ShardBaker
    region: Optional[Tuple[float, ...]]
    worker_count: int


class Plan(NamedTuple):
    """What planning found out."""
    shard_count: int
    notes: Tuple[str, ...]  # about the raster


class Submitted(NamedTuple):
    """Futures of a bake that has been submitted."""
    plan: Plan
    shards: List[Any]  # each becomes True if its shard was baked, False if it was complete
    store: Any  # becomes a StoreInfo when the folder is a store


# ---- Tasks. They are functions of this module, so that a worker imports them, and keeps what they opened.

_lock = threading.Lock()
_held: Dict[str, Tuple[Any, Any]] = {}  # the last source and the last baker, each with its key


def _hold(name: str, key: Any, make: Callable[[], Any], is_new: bool = False) -> Any:
    """The last object of a name if its key is the same, otherwise a new one."""
    if is_new or name not in _held or _held[name][0] != key:
        _held.pop(name, None)
        _held[name] = (key, make())
    return _held[name][1]


def _open(job: Job, is_new: bool) -> Tuple[Any, Any]:
    """The source and the baker of a job. A process keeps them for the next shard, unless the raster's file changes.

    With is_new the baker is made again, which writes the plan.
    """
    try:
        file = os.stat(job.source)
        version = (file.st_mtime_ns, file.st_size)
    except OSError:
        version = (0, 0)  # a source of GDAL that is not a file
    with _lock:
        # GDAL's cache, by default 5 % of the machine's memory for each process
        os.environ.setdefault("GDAL_CACHEMAX", "256")
        # The scan is written with the plan. With it, a worker reads only the samples of its shards.
        dem = _with_cache_folder({"scan_file": os.path.join(job.folder, "raster.scan"), **dict(job.dem)})
        source = _hold("source", (job.source, dem, version), lambda: _terrane.open_dem(job.source, **dem))
        baker = _hold("baker", (job, version), lambda: _terrane.ShardBaker(
            source, job.folder, level_count=job.level_count, region=None if job.region is None else list(job.region),
            worker_count=job.worker_count), is_new)
        return source, baker


def _with_cache_folder(dem: dict) -> dict:
    """Adds the user's cache folder on this machine, that of the program, where none is given."""
    if dem.get("cache", "none") != "none" and not dem.get("cache_folder"):
        # Relative paths must be ignored: XDG Base Directory Specification 0.8.
        cache, home = os.environ.get("XDG_CACHE_HOME", ""), os.environ.get("HOME", "")
        dem["cache_folder"] = (cache + "/terrane" if cache.startswith("/") else
                               home + "/.cache/terrane" if home.startswith("/") else "")
    return dem


def plan_shards(job: Job) -> Plan:
    """The task that writes the plan."""
    source, baker = _open(job, is_new=True)
    notes = ([source.info.cache_note] if source.info.cache_note else []) + list(source.info.notes)
    return Plan(baker.shard_count, tuple(notes))


def bake_shard(job: Job, shard: int) -> bool:
    """The task of a shard: whether it had to be baked."""
    return _open(job, is_new=False)[1].bake_shard(shard)


def combine_shards(folder: str, baked: Sequence[bool]) -> Any:
    """The task that depends on all shards, and makes a store of the folder."""
    return _terrane.ShardBaker.combine(folder)


# ---- The graph.

def _absolute(path: str) -> str:
    """A path for workers in other folders; names of GDAL that are no files remain."""
    return os.path.abspath(path) if os.path.exists(path) else path


def submit(client: Any, source: str, folder: str, *, level_count: int = 0, region: Optional[Sequence[float]] = None,
           worker_count: int = 1, retries: int = RETRIES, **dem: Any) -> Submitted:
    """Submits the bake of a raster to a client of Dask. Waits for the plan, and for no shard.

    source, folder  paths that all workers have
    level_count, region  as of ShardBaker
    worker_count    threads of a task
    retries         of a task that fails
    dem             arguments of open_dem(), other than progress

    submit(...).store.result() waits for the StoreInfo. Raises what planning raises, as open_dem() and ShardBaker().
    """
    job = Job(_absolute(source), os.path.abspath(folder), tuple(sorted(dem.items())), level_count,
              None if region is None else tuple(map(float, region)), worker_count)
    # A result is not kept for the next call, before which files may have changed: pure=False.
    return _submit_shards(client, job, client.submit(plan_shards, job, pure=False).result(), retries)


def _submit_shards(client: Any, job: Job, plan: Plan, retries: int) -> Submitted:
    shards = client.map(bake_shard, [job] * plan.shard_count, range(plan.shard_count), pure=False, retries=retries)
    store = client.submit(combine_shards, job.folder, shards, pure=False, retries=retries)
    return Submitted(plan, shards, store)


# ---- The command.

class BadCommandLine(Exception):
    """The command line is invalid, whatever the files hold: exit code 2."""


class Failure(Exception):
    """Any other reason to give up: exit code 1."""


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> None:  # type: ignore[override]
        raise BadCommandLine(re.sub(r"^argument (\S+): (?=must)", r"\1 ", message))


def format_progress(what: str, done: int, count: int, baked: int, elapsed: float) -> str:
    """The line of progress: "baking: 42 %, 1 min 20 s left".

    baked  how many of the `done` shards took time; the others were complete
    """
    line = f"{what}: {math.floor(100 * done / count)} %"
    if baked and done < count:
        line += f", {format_time(elapsed / baked * (count - done))} left"
    return line


def format_time(seconds: float) -> str:
    """A duration for people: "1 min 20 s"."""
    whole = math.ceil(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"


class Progress:
    """A line on a terminal, or, in a file, a new line from time to time."""

    def __init__(self, stream: TextIO) -> None:
        self.stream = stream
        self.is_terminal = stream.isatty()
        self.next = time.monotonic() + (0.3 if self.is_terminal else LINE_SECONDS)
        self.is_drawn = False

    def show(self, text: str) -> None:
        if time.monotonic() < self.next:
            return
        self.next = time.monotonic() + (0.2 if self.is_terminal else LINE_SECONDS)
        self.stream.write(f"\r\x1b[K{text}" if self.is_terminal else text + "\n")
        self.stream.flush()
        self.is_drawn = True

    def clear(self) -> None:
        if self.is_drawn and self.is_terminal:
            self.stream.write("\r\x1b[K")
            self.stream.flush()
        self.is_drawn = False


def _number(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise ValueError
    return value


def _checked(name: str, parse: Any, is_met: Any = lambda value: True) -> Any:
    """A type of argparse: its errors have the wanted value, and the value."""
    def read(text: str) -> Any:
        try:
            value = parse(text)
            if is_met(value):
                return value
        except (ValueError, OverflowError):
            pass
        raise argparse.ArgumentTypeError(f"must be {name}, got '{text[:60]}'")
    return read


def _numbers(text: str) -> List[float]:
    return [_number(item) for item in text.split(",")]


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="python3 -m terrane.bake", allow_abbrev=False, formatter_class=argparse.RawDescriptionHelpFormatter,
        description="Bakes a raster in shards on Dask. The folder has the same bytes as that of\n"
                    "'terrane bake --dem SOURCE --out DEST --sharded', with any number of workers.\n"
                    "Run again after a failure, it bakes what is missing. Workers on other machines need\n"
                    "this module.",
        epilog="Example: python3 -m terrane.bake tools/data/jacksboro.tif jacksboro")
    # Lists of numbers may begin with a minus.
    parser._negative_number_matcher = re.compile(r"^-\d[\d.,eE+-]*$")  # type: ignore[attr-defined]
    whole = _checked("a whole number of at least 1", int, lambda n: 1 <= n < 2**31)
    above_0 = _checked("a number above 0", _number, lambda x: x > 0)
    add = parser.add_argument
    add("source", metavar="SOURCE", help="raster of heights, in any format that GDAL reads; a path that all workers have")
    add("folder", metavar="DEST", help="folder of the baked terrain, whose complete shards are kept; a path that all workers have")
    add("--scheduler", metavar="ADDRESS", help="scheduler of Dask whose workers bake, such as tcp://host:8786; without it, "
        "workers are started on this machine")
    add("--workers", type=_checked("1 to 1024", int, lambda n: 1 <= n <= 1024), metavar="N",
        help="worker processes on this machine, each of which opens the raster; as many as it has processors unless said")
    add("--threads", type=_checked("1 to 256", int, lambda n: 1 <= n <= 256), default=1, metavar="N",
        help="threads that make the chunks of a shard; 1 unless said")
    add("--retries", type=_checked("0 to 1000", int, lambda n: 0 <= n <= 1000), default=RETRIES, metavar="N",
        help=f"how often the task of a shard is repeated if it fails; {RETRIES} unless said")
    add("--levels", type=whole, default=0, metavar="N", help="levels to bake, from the root squares on; all of them unless said")
    add("--region", type=_checked("four numbers W,S,E,N", _numbers, lambda v: len(v) == 4), metavar="W,S,E,N",
        help="bake a part of the world only: west, south, east, north in metres, widened to whole chunks")
    add("--seed", type=_checked("0 to 18446744073709551615", int, lambda n: 0 <= n < 2**64), metavar="N",
        help="fractal detail below the raster's resolution")
    add("--detail-m", type=above_0, metavar="X", help="finest spacing of the ground, metres: without it the raster's own cell, and 1 "
        "where there is a seed")
    add("--height-unit", metavar="UNIT", type=_checked("a unit", str, bool), help="unit of the raster's numbers, such as m, foot or us-ft")
    add("--height-scale", type=_checked("a number other than 0", _number, bool), metavar="X", help="factor of the raster's heights; -1 for depths")
    add("--nodata", type=_checked("numbers separated by commas, or none", lambda text: [] if text == "none" else _numbers(text)),
        metavar="X,...", help="numbers that are nodata besides those that the file declares; 'none': numbers such as -9999 are heights")
    add("--encoding", choices=["numbers", "terrarium", "mapbox"], help="how the bands encode heights")
    add("--cell-m", type=above_0, metavar="X", help="side of the cells of a raster without georeferencing, or of one that is resampled, metres")
    add("--project", choices=["none", "local"], help="'local': the world is the tangent plane at the raster's middle")
    add("--crop", type=_checked("four numbers W,S,E,N", _numbers, lambda v: len(v) == 4), metavar="W,S,E,N",
        help="rectangle to which the raster is cropped, in the units of its CRS")
    add("--dem-memory-mb", type=above_0, default=2048.0, metavar="N", help="most memory of the raster in each process, MiB; 2048 unless said")
    add("--cache", metavar="DIR", help="where the bounds of the raster are kept, so that it opens faster the next time: a folder, "
        "'beside' the raster, or 'off'; without it the user's cache folder")
    add("--json", action="store_true", help="print one JSON object")
    return parser


def _dem_settings(options: argparse.Namespace) -> dict:
    """Arguments of open_dem(), as the program has them."""
    spacing = options.detail_m if options.detail_m is not None else 0.0 if options.seed is None else 1.0
    dem = {"detail_seed": options.seed, "finest_spacing": spacing, "memory_bytes": int(options.dem_memory_mb * 2**20)}
    if options.nodata is not None:
        dem["nodata"] = tuple(options.nodata)
    for name, value in (("height_unit", options.height_unit), ("height_scale", options.height_scale), ("cell", options.cell_m),
                        ("encoding", options.encoding), ("crop", options.crop)):
        if value is not None:
            dem[name] = value
    if options.project == "local":
        dem["projection"] = "local"
    if options.cache == "off":
        dem["cache"] = "none"
    elif options.cache == "beside":
        dem["cache"] = "beside"
    else:
        dem["cache"] = "folder"
        if options.cache:
            dem["cache_folder"] = os.path.abspath(options.cache)
    return dem


# Fields of settings at the beginning of messages, and their flags.
_FLAGS = {"finest_spacing": "--detail-m", "height_unit": "--height-unit", "level_count": "--levels", "region": "--region"}


def _explain(error: BaseException) -> Exception:
    """The error of a task as one of the command."""
    text = " ".join(str(error).split()).rstrip(".")
    if isinstance(error, ValueError):
        for field, flag in _FLAGS.items():
            if text.startswith(field + " "):
                return BadCommandLine(flag + text[len(field):])
    if type(error).__name__ == "KilledWorker":
        task, count = error.task, error.allowed_failures  # type: ignore[attr-defined]
        return Failure(f"{task} is given up: {count} workers that ran it were lost; with fewer --workers, each has more memory")
    return Failure(text or type(error).__name__)


def _connect(distributed: Any, address: str) -> Any:
    try:
        return distributed.Client(address, timeout=ANSWER_SECONDS)
    except ValueError as error:  # an unknown scheme
        raise BadCommandLine(f"--scheduler must be an address such as tcp://host:8786, got '{address}': {error}") from error
    except (OSError, TimeoutError) as error:
        raise Failure(f"the scheduler {address} does not answer within {ANSWER_SECONDS:.0f} s") from error


def _wait(distributed: Any, future: Any, progress: Progress, what: str) -> Any:
    """The result of a task, with the elapsed time."""
    begin = time.monotonic()
    while not future.done():
        try:
            distributed.wait([future], timeout=0.5)
        except (TimeoutError, distributed.TimeoutError):
            progress.show(f"{what}: {format_time(time.monotonic() - begin)}")
    return future.result()


def _bake(distributed: Any, client: Any, options: argparse.Namespace, progress: Progress) -> dict:
    job = Job(_absolute(options.source), os.path.abspath(options.folder), tuple(sorted(_dem_settings(options).items())),
              options.levels, None if options.region is None else tuple(options.region), options.threads)
    if options.scheduler and not client.scheduler_info()["workers"]:
        _print(f"the scheduler {options.scheduler} has no workers yet")
    plan = _wait(distributed, client.submit(plan_shards, job, pure=False), progress, "opening " + options.source)
    progress.clear()
    for note in plan.notes:
        _print(note)
    submitted = _submit_shards(client, job, plan, options.retries)
    begin = time.monotonic()
    done = baked = 0
    for _, is_baked in distributed.as_completed(submitted.shards, with_results=True):
        done += 1
        baked += is_baked
        progress.show(format_progress("baking", done, plan.shard_count, baked, time.monotonic() - begin))
    store = _wait(distributed, submitted.store, progress, "combining")
    return {"shards": plan.shard_count, "baked": baked, "found": plan.shard_count - baked, "chunks": store.chunk_count,
            "bytes": store.bytes, "max_error_m": store.max_error_m, "sha": store.sha, "out": options.folder}


def _run(arguments: Sequence[str]) -> None:
    options = _parser().parse_args(arguments)
    if options.scheduler and options.workers:
        raise BadCommandLine("--workers does not go with --scheduler, which has its own")
    for component in ("dem", "store"):
        if component not in _terrane.components:
            raise Failure(f"this Terrane was built without the component '{component}'")
    try:
        import distributed
    except ImportError as error:
        raise Failure(f"needs Dask distributed, Debian's python3-distributed ({error})") from error
    import logging
    progress = Progress(sys.stderr)
    try:
        if options.scheduler:
            with _connect(distributed, options.scheduler) as client:
                summary = _bake(distributed, client, options, progress)
        else:
            # Scheduler and dashboard are on the loopback interface. What workers log of failed tasks is in the message.
            with tempfile.TemporaryDirectory(prefix="terrane_bake_") as folder, distributed.LocalCluster(
                    n_workers=options.workers or os.cpu_count() or 1, threads_per_worker=1, processes=True, host="127.0.0.1",
                    dashboard_address="127.0.0.1:0", local_directory=folder, silence_logs=logging.CRITICAL) as cluster, \
                    distributed.Client(cluster) as client:
                summary = _bake(distributed, client, options, progress)
    finally:
        progress.clear()
    if options.json:
        print(json.dumps(summary))
    else:
        for key, value in summary.items():
            print(key, f"{value:.4g}" if isinstance(value, float) else value)


def _print(message: str) -> None:
    print("terrane.bake: " + " ".join(message.split()), file=sys.stderr, flush=True)


def main(arguments: Optional[Sequence[str]] = None) -> int:
    """Runs the command, and returns its exit code: 0, 1 for a failure, 2 for an invalid command line."""
    try:
        _run(sys.argv[1:] if arguments is None else arguments)
        return 0
    except KeyboardInterrupt:
        _print("given up; the same command continues")
        return 1
    except BadCommandLine as error:
        _print(str(error))
        return 2
    except Failure as error:
        _print(str(error))
        return 1
    except Exception as error:  # of a task, or of Dask
        explained = _explain(error)
        _print(str(explained))
        return 2 if isinstance(explained, BadCommandLine) else 1


class _Callable(types.ModuleType):
    """This module, which takes the place of the function terrane.bake() once it has been imported."""

    def __call__(self, source: Any, path: Any, **settings: Any) -> Any:
        """As the function: bakes one file."""
        return _terrane.bake(source, path, **settings)


if __name__ == "__main__":
    # Workers know the functions by the name of this module, not as those of __main__.
    from terrane.bake import main as run
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    sys.exit(run())
sys.modules[__name__].__class__ = _Callable
