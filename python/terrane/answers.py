# SPDX-License-Identifier: MIT
"""What calls of terrane answer: enumerations of statuses, and named tuples of arrays.

(S) is the shape of the question: that of x for heights, (n,) for n rows, () where every argument was a single one.
Lengths are metres, world axes: x east, y north, z up. Where a status is not ok, numbers are NaN.
"""
from enum import IntEnum, IntFlag
from typing import TYPE_CHECKING, NamedTuple, Tuple

import numpy as np

if TYPE_CHECKING:
    from . import Ground, Mesh, Node, Shape


class QueryStatus(IntEnum):
    """Whether a query has an answer, and why not. An answer that is not_resident must not move a body."""

    ok = 0
    miss = 1
    outside = 2
    truncated = 3
    not_resident = 4
    invalid = 5


class MeshStatus(IntEnum):
    """Whether a mesh meets its target, and why not."""

    error_met = 0
    budget_reached = 1
    finest_reached = 2
    not_resident = 3
    invalid_view = 4


class RegionState(IntEnum):
    """The state of a RequiredRegion."""

    loading = 0
    ready = 1
    failing = 2
    released = 3


class CellFlag(IntFlag):
    """Bits of Chunk.cell_flags."""

    ground = 0
    outside = 1
    filled = 2


class BodyCondition(IntEnum):
    """How a body takes part in a step."""

    awake = 0
    asleep = 1
    parked = 2
    left_world = 3
    fixed = 4
    removed = 5


class ContactPhase(IntEnum):
    """What a step did to a contact."""

    began = 0
    stayed = 1
    ended = 2


class LidarStatus(IntEnum):
    """What a ray of a scan meets first."""

    miss = 0
    ground = 1
    body = 2
    not_resident = 3
    outside = 4
    invalid = 5


class DriverStatus(IntEnum):
    """What a PathDriver is doing."""

    driving = 0
    stuck = 1
    rolled_over = 2
    finished = 3


class Lattice(NamedTuple):
    """The integer addresses of the samples of a world."""

    origin: Tuple[float, float]  # world x and y of lattice point (0, 0), metres
    spacing: float  # between neighbours of the finest level, metres
    quantum: float  # heights are multiples of this, metres
    finest_level: int  # level 0 is a root square
    root_size: float  # side of a root square, metres
    first_root: Tuple[int, int]  # column and row of the south-western root square
    root_count: Tuple[int, int]  # to the east and to the north


class DemInfo(NamedTuple):
    """Size, georeferencing and statistics of a raster."""

    columns: int
    rows: int
    cell: Tuple[float, float]  # metres
    min_m: float  # of the valid samples, metres
    max_m: float
    nodata_share: float  # of the samples, voids included, 0 to 1
    filled_share: float  # of the samples: enclosed voids that were filled
    crs: str  # name of the coordinate system; "" if there is none
    crs_wkt: str
    geographic: bool
    centre: Tuple[float, float]  # of world (0, 0) in the CRS, in its units
    metres_per_unit: Tuple[float, float]  # x = (X - centre[0]) * metres_per_unit[0]
    scale_error: float  # bound of the relative error of lengths up to 20 km
    from_cache: bool  # bounds were read from the cache
    cache_note: str  # why a cache file was refused or not written
    numbers: str  # what each of these was taken to be, and from where: "Int16"
    height_unit: str  # "foot, from the band"
    vertical_axis: str  # "up, assumed"
    nodata: str  # "-9999, declared"
    placement: str  # "a geotransform"
    notes: Tuple[str, ...]  # assumptions about the meaning of the file
    resampling_error: float  # largest distance of a resampled raster from its own surface, metres; 0: not resampled
    projection: str  # "own" or "local"
    middle_lonlat: Tuple[float, float]  # of a local tangent plane, degrees
    samples_hash: str  # of all samples, 32 hexadecimal digits; "" without a scan_file


class PlaneScale(NamedTuple):
    """Lengths and directions in the world's plane against those on the ellipsoid of WGS 84, at one place."""

    x: float  # metres on the ellipsoid per metre of world x
    y: float  # metres on the ellipsoid per metre of world y
    convergence: float  # angle from world y to true north, radians, positive counterclockwise


class StoreInfo(NamedTuple):
    """A baked terrain."""

    chunk_count: int
    bytes: int
    max_error_m: float  # certified distance of its finest level from the source, metres
    sha: str  # SHA-256 of the content, 64 hexadecimal digits
    note: bytes


class HttpFailures(NamedTuple):
    """Requests that failed, by cause. Each repetition that fails counts."""

    refused: int  # status 4xx, except 408, 416 and 429, or another that is no success
    busy: int  # status 429 or 503
    server_error: int  # other status 5xx
    cut_short: int  # the reply ended early or was no HTTP
    wrong_range: int  # not the requested range, the whole of a large file, or an encoded body
    wrong_size: int  # the file is not as long as it must be
    timed_out: int  # no connection, or no data, in time; status 408
    unresolved: int  # the host's name does not resolve
    unreachable: int  # the connection was refused or lost
    certificate: int  # the certificate is not trusted, or is for another host
    redirect: int  # too many redirects, or one to an address that is not permitted


class HttpStatistics(NamedTuple):
    """What was read from a server since open_http(), and what went wrong."""

    requests: int  # that were sent
    bytes: int  # of replies, without headers
    memory_hits: int  # blocks found in memory
    disk_hits: int  # blocks found in the disk cache
    shared_blocks: int  # that another read had already requested
    retries: int  # failed requests whose blocks were requested again
    cancelled: int  # requests that were stopped because nobody waited any more
    discarded: int  # blocks, or parts of them, that turned out to be damaged
    damaged_blocks: int  # of the disk cache, removed for a wrong checksum
    cache_faults: int  # blocks that could not be written to the disk cache
    ignored_ranges: int  # replies with the whole file in place of a part, which was taken from them
    failures: HttpFailures
    latency: float  # seconds from a request to the first byte of its reply; 0: none yet
    bandwidth: float  # bytes a second of all requests together; 0: none yet


class PagerStats(NamedTuple):
    """Counts since a Terrain was made; the first six and bytes_awaited are present values."""

    resident_bytes: int
    in_flight_bytes: int
    resident_chunks: int
    late_chunks: int
    fading_chunks: int
    groundless_bodies: int
    peak_bytes: int
    loaded: int
    evicted: int
    reloaded: int
    cancelled: int
    failed: int
    timed_out: int
    refused_needs: int
    cut_needs: int
    over_ceiling: int
    hard_evictions: int
    bytes_read: int
    bytes_used: int
    bytes_awaited: int


class Frame(NamedTuple):
    """The terrain at one moment: the ground to stand on, and a mesh for each camera."""

    ground: "Ground"  # the contact surface of the resident chunks: a snapshot
    meshes: Tuple["Mesh", ...]  # of the cameras, in their order; valid until the next update
    late_chunks: int  # needed now, and absent
    groundless_bodies: int  # bodies whose ground is not resident yet


class Heights(NamedTuple):
    """The surface over places."""

    height: np.ndarray  # float64 (S), world z, metres
    normal: np.ndarray  # float64 (S, 3), unit, out of the solid
    error_m: np.ndarray  # float64 (S), certified: the true surface is within this, metres
    filled: np.ndarray  # bool (S): over an enclosed void that was filled
    status: np.ndarray  # int8 (S), QueryStatus


class Rays(NamedTuple):
    """Where rays first meet the surface."""

    fraction: np.ndarray  # float64 (S), of the segment from from_world to to_world, 0 to 1
    point_world: np.ndarray  # float64 (S, 3), metres
    normal: np.ndarray  # float64 (S, 3), unit, out of the solid
    error_m: np.ndarray  # float64 (S), bound of the true surface's vertical distance, metres
    filled: np.ndarray  # bool (S)
    status: np.ndarray  # int8 (S), QueryStatus


class Contacts(NamedTuple):
    """Contacts of a shape at several poses: those of pose i are first[i] to first[i + 1], deepest first."""

    first: np.ndarray  # int64 (n + 1,), indices of the five arrays of contacts, each of m entries
    point_world: np.ndarray  # float64 (m, 3), on the shape, metres
    normal: np.ndarray  # float64 (m, 3), unit, out of the ground, or of b towards a
    depth: np.ndarray  # float64 (m,), metres; negative: a gap
    part: np.ndarray  # uint32 (m,), index of the part of a compound, else 0
    part_b: np.ndarray  # uint32 (m,), the same for the other shape; 0 for the ground
    lift: np.ndarray  # float64 (n,), vertical overlap, metres; between shapes NaN
    error_m: np.ndarray  # float64 (n,), largest bound of the cells tested, metres; between shapes 0
    status: np.ndarray  # int8 (n,), QueryStatus


class Distances(NamedTuple):
    """Signed distances of a shape from the ground."""

    distance: np.ndarray  # float64 (S): the gap, or minus the length of a translation that separates, metres
    lower_bound: np.ndarray  # float64 (S), certified, metres: no shorter translation separates
    point_world: np.ndarray  # float64 (S, 3), closest or deepest point of the shape, metres
    normal: np.ndarray  # float64 (S, 3), unit, out of the ground
    error_m: np.ndarray  # float64 (S), largest bound of the cells tested, metres
    has_ground: np.ndarray  # bool (S): false where there is none within max_distance
    status: np.ndarray  # int8 (S), QueryStatus


class Casts(NamedTuple):
    """First contacts of a moving shape."""

    hit: np.ndarray  # bool (S)
    fraction: np.ndarray  # float64 (S), of the motion, 0 to 1: no overlap before it
    started_in_contact: np.ndarray  # bool (S)
    point_world: np.ndarray  # float64 (S, 3), metres; NaN without a hit
    normal: np.ndarray  # float64 (S, 3), unit; NaN without a hit
    depth: np.ndarray  # float64 (S), at fraction, metres; NaN without a hit
    error_m: np.ndarray  # float64 (S), metres; between shapes 0
    status: np.ndarray  # int8 (S), QueryStatus


class PairDistances(NamedTuple):
    """Signed distances of two shapes."""

    distance: np.ndarray  # float64 (S), metres
    point_a_world: np.ndarray  # float64 (S, 3), metres
    point_b_world: np.ndarray  # float64 (S, 3), metres
    normal: np.ndarray  # float64 (S, 3), unit, out of b, towards a
    part_a: np.ndarray  # uint32 (S), part of a compound that has the point, else 0
    part_b: np.ndarray  # uint32 (S)
    status: np.ndarray  # int8 (S), QueryStatus


class BodyState(NamedTuple):
    """A body after a step."""

    position: np.ndarray  # float64 (3,), world, metres
    rotation: np.ndarray  # float64 (3, 3), world from shape
    velocity: np.ndarray  # float64 (3,), of the centre of mass, m/s
    angular_velocity: np.ndarray  # float64 (3,), world axes, rad/s
    condition: BodyCondition


class BodySettings(NamedTuple):
    """What a body is made of: arguments of World.add()."""

    shape: "Shape"
    type: str
    mass: float  # kilograms
    friction: float
    restitution: float
    contact_tolerance: float  # metres; 0: Shape.contact_tolerance
    layers: int
    collides_with: int
    is_sensor: bool
    rotates: bool


class BodyStates(NamedTuple):
    """Every body of a world, by the index of its id: copies."""

    body: np.ndarray  # uint64 (n,), id; NO_BODY where there is none
    position: np.ndarray  # float64 (n, 3), world, metres
    rotation: np.ndarray  # float64 (n, 3, 3), world from shape
    velocity: np.ndarray  # float64 (n, 3), of the centre of mass, m/s
    angular_velocity: np.ndarray  # float64 (n, 3), world axes, rad/s
    condition: np.ndarray  # int8 (n,), BodyCondition


class StepReport(NamedTuple):
    """Counts and limits of one step."""

    awake: int
    parked: int
    left_world: int
    asleep: int
    touching_pairs: int
    islands: int
    impacts: int
    simulated_time: float  # summed over bodies, seconds
    lost_time: float  # cut off after too many impacts in a substep, seconds
    max_depth_m: float  # largest penetration depth after the step, metres
    too_deep: int  # bodies deeper than their tolerance that were not placed so
    placed_deep: int
    kinematic_in_ground: int
    skipped_pairs: int


class Vehicle(NamedTuple):
    """A vehicle after a step, with w wheels: axle by axle from the front, left before right."""

    position: np.ndarray  # float64 (3,), of the chassis, world, metres
    rotation: np.ndarray  # float64 (3, 3), world from chassis; x is forward, y left
    velocity: np.ndarray  # float64 (3,), m/s
    angular_velocity: np.ndarray  # float64 (3,), rad/s
    condition: BodyCondition
    is_rolled_over: bool
    wheel_centre: np.ndarray  # float64 (w, 3), world, metres
    compression: np.ndarray  # float64 (w,), 0 (hanging) to the travel, metres
    spin: np.ndarray  # float64 (w,), angle turned about the axle, radians
    steer: np.ndarray  # float64 (w,), radians, positive to the left
    in_contact: np.ndarray  # bool (w,)
    load: np.ndarray  # float64 (w,), force of the suspension, N


class Character(NamedTuple):
    """A character after a step."""

    position: np.ndarray  # float64 (3,), of the capsule's centre, world, metres
    velocity: np.ndarray  # float64 (3,), m/s
    stands: bool  # on a slope of at most max_slope
    support: int  # id of the body that it stands on; NO_BODY on the ground or in the air
    normal: np.ndarray  # float64 (3,), unit, of what it stands on
    condition: BodyCondition


class WorldRays(NamedTuple):
    """Where rays first meet a body or the ground."""

    hit: np.ndarray  # bool (S)
    fraction: np.ndarray  # float64 (S), of the segment, 0 to 1
    body: np.ndarray  # uint64 (S), id; NO_BODY where it is the ground, or nothing
    point_world: np.ndarray  # float64 (S, 3), metres; NaN without a hit
    normal: np.ndarray  # float64 (S, 3), unit; NaN without a hit
    status: np.ndarray  # int8 (S), QueryStatus


class SceneHit(NamedTuple):
    """Where a segment first hits an object of a Scene."""

    node: "Node"
    object: int  # of the node's instances: its index, else 0
    fraction: float  # of the segment, 0 to 1
    point_world: np.ndarray  # float64 (3,), metres
    normal: np.ndarray  # float64 (3,), unit, world axes, against the segment
    triangle: int  # of the model's triangles


class SceneCounts(NamedTuple):
    """What a picture of a Scene has drawn; counts of objects are of objects and instances."""

    objects: int  # in the scene
    in_view: int
    drawn: int
    left_out: int  # in view, too small to be seen
    continuous: int  # with continuous levels of detail
    triangles: int  # of objects and particles
    particles: int  # in view
    culled_nodes: int  # out of view
    casters: int  # out of view, whose shadows may be in view


class LidarScan(NamedTuple):
    """What the n rays of a scan meet first; NaN where it is nothing."""

    range: np.ndarray  # float64 (n,), from the sensor's origin, metres
    point_world: np.ndarray  # float64 (n, 3), metres
    normal: np.ndarray  # float64 (n, 3), unit, world axes
    body: np.ndarray  # uint64 (n,), id; NO_BODY where it is the ground, or nothing
    part: np.ndarray  # uint32 (n,), of a body that is a compound: its part
    status: np.ndarray  # int8 (n,), LidarStatus


class ContactEvents(NamedTuple):
    """The contacts of a step, by ascending (a, b), those with the ground last."""

    a: np.ndarray  # uint64 (n,), id
    b: np.ndarray  # uint64 (n,), id; NO_BODY: the ground
    phase: np.ndarray  # int8 (n,), ContactPhase
    is_sensor: np.ndarray  # bool (n,)
    impulse: np.ndarray  # float64 (n, 3), on a, over the step, N s
    normal: np.ndarray  # float64 (n, 3), unit, into a


__all__ = [name for name, value in list(globals().items())
           if isinstance(value, type) and value.__module__ == __name__]
