// SPDX-License-Identifier: MIT
#include "support/faulty_heights.h"

#include "support/random.h"

#include <fcntl.h>
#include <sys/fsuid.h>
#include <unistd.h>

#include <cerrno>
#include <fstream>
#include <new>
#include <span>
#include <stdexcept>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

namespace terrane::test {
namespace {

// Rounds towards minus infinity.
std::int32_t divide(std::int64_t value, std::int64_t side) {
    const std::int64_t whole = value / side;
    return static_cast<std::int32_t>(value < 0 && whole * side != value ? whole - 1 : whole);
}

// Uniform in [0, 1).
double chance(const FaultRule& rule, Question question, const SampleGrid& grid,
              std::uint64_t times_asked) {
    Hash hash;
    hash.add(rule.seed);
    hash.add(question);
    hash.add(grid.corner.x);
    hash.add(grid.corner.y);
    hash.add(grid.step);
    hash.add(times_asked);
    return Random(hash.value()).between(0.0, 1.0);
}

}  // namespace

ChunkKey chunk_of(const Lattice& lattice, const SampleGrid& grid) {
    int level = lattice.finest_level;
    while (level > 0 && lattice.step(level) < grid.step) --level;
    const std::int64_t middle_x = grid.corner.x + grid.step * (grid.columns - 1) / 2;
    const std::int64_t middle_y = grid.corner.y + grid.step * (grid.rows - 1) / 2;
    return {divide(middle_x, lattice.chunk_side(level)),
            divide(middle_y, lattice.chunk_side(level)), static_cast<std::uint8_t>(level)};
}

FaultyHeights::FaultyHeights(std::shared_ptr<const HeightSource> ground,
                             std::vector<FaultRule> plan)
    : ForwardedHeights(std::move(ground)) {
    set_plan(std::move(plan));
}

void FaultyHeights::set_plan(std::vector<FaultRule> plan) {
    const std::lock_guard lock(mutex_);
    ++plan_count_;
    plan_.clear();
    asked_.clear();
    for (const FaultRule& rule : plan) plan_.push_back({rule, 0});
}

void FaultyHeights::release() {
    const std::lock_guard lock(mutex_);
    released_plans_ = plan_count_;
    changed_.notify_all();
}

void FaultyHeights::wait_for_hung(int count) const {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return hung_count_ >= count; });
}

int FaultyHeights::question_count() const {
    const std::lock_guard lock(mutex_);
    return question_count_;
}

std::vector<ChunkKey> FaultyHeights::sampled() const {
    const std::lock_guard lock(mutex_);
    return sampled_;
}

bool FaultyHeights::matches(const FaultRule& rule, Question question,
                            const SampleGrid& grid) const {
    if (rule.question != Question::any && rule.question != question) return false;
    if (rule.chunk && *rule.chunk != chunk_of(lattice(), grid)) return false;
    if (!rule.area) return true;
    return lattice().x(grid.corner.x) <= rule.area->east &&
           lattice().y(grid.corner.y) <= rule.area->north &&
           lattice().x(grid.corner.x + grid.step * (grid.columns - 1)) >= rule.area->west &&
           lattice().y(grid.corner.y + grid.step * (grid.rows - 1)) >= rule.area->south;
}

// Requires that the lock is held.
FaultRule FaultyHeights::find_rule(Question question, const SampleGrid& grid) const {
    const std::uint64_t times_asked = asked_[{question, grid.corner, grid.step, grid.columns}]++;
    for (Rule& entry : plan_) {
        const FaultRule& rule = entry.rule;
        if (!matches(rule, question, grid)) continue;
        const int before = entry.match_count++;
        if (before < rule.passes || before - rule.passes >= rule.times) continue;
        if (chance(rule, question, grid, times_asked) < rule.share) return rule;
    }
    return {};
}

// Applies faults that change the returned values.
Result<Fault> FaultyHeights::meet(Question question, const SampleGrid& grid) const {
    std::unique_lock lock(mutex_);
    ++question_count_;
    if (question == Question::sample) sampled_.push_back(chunk_of(lattice(), grid));
    const FaultRule rule = find_rule(question, grid);
    if (rule.delay.count() > 0) {
        lock.unlock();
        std::this_thread::sleep_for(rule.delay);
        lock.lock();
    }
    switch (rule.fault) {
        case Fault::none:
        case Fault::nan:
        case Fault::too_high:
            break;
        case Fault::read_error:
            return fail(ErrorCode::io, "the disk cannot be read");
        case Fault::permission_denied:
            return fail(ErrorCode::io, "permission denied");
        case Fault::truncated:
            return fail(ErrorCode::bad_data, "the file ends early");
        case Fault::no_memory:
            throw std::bad_alloc();
        case Fault::exception:
            throw std::runtime_error("the source threw");
        case Fault::odd_exception:
            throw 7;
        case Fault::hang:
            const std::uint64_t plan = plan_count_;
            ++hung_count_;
            changed_.notify_all();
            changed_.wait(lock, [&] { return released_plans_ >= plan; });
            --hung_count_;
            return Fault::none;
    }
    return rule.fault;
}

Result<void> FaultyHeights::sample(const SampleGrid& grid, std::span<double> heights_out) const {
    TERRANE_TRY(const Fault fault, meet(Question::sample, grid));
    TERRANE_TRY(heights().sample(grid, heights_out));
    double& one = heights_out[heights_out.size() / 2];
    if (fault == Fault::nan) one = std::numeric_limits<double>::quiet_NaN();
    if (fault == Fault::too_high) one = 0x1p31 * lattice().quantum;
    return {};
}

Result<void> FaultyHeights::vertex_bounds(const SampleGrid& grid,
                                          std::span<float> bounds_out) const {
    TERRANE_TRY(const Fault fault, meet(Question::bounds, grid));
    TERRANE_TRY(heights().vertex_bounds(grid, bounds_out));
    // in an odd column, so that it is a vertex of the grid's spacing
    if (fault == Fault::nan) bounds_out[1] = std::numeric_limits<float>::quiet_NaN();
    return {};
}

Result<void> FaultyHeights::cell_bounds(const SampleGrid& grid, std::span<float> bounds_out) const {
    TERRANE_TRY(const Fault fault, meet(Question::bounds, grid));
    TERRANE_TRY(heights().cell_bounds(grid, bounds_out));
    if (fault == Fault::nan) bounds_out[0] = std::numeric_limits<float>::quiet_NaN();
    return {};
}

Result<void> FaultyHeights::mesh_bounds(const SampleGrid& grid, std::span<float> vertex_bounds_out,
                                        std::span<float> cell_bounds_out) const {
    TERRANE_TRY(const Fault fault, meet(Question::bounds, grid));
    TERRANE_TRY(heights().mesh_bounds(grid, vertex_bounds_out, cell_bounds_out));
    if (fault == Fault::nan) cell_bounds_out[0] = std::numeric_limits<float>::quiet_NaN();
    return {};
}

Result<void> FaultyHeights::cell_flags(const SampleGrid& grid,
                                       std::span<std::uint8_t> flags_out) const {
    TERRANE_TRY(meet(Question::flags, grid));
    return heights().cell_flags(grid, flags_out);
}

namespace {

constexpr uid_t kNobody = 65534;

std::string trouble() { return std::error_code(errno, std::generic_category()).message(); }

std::size_t row_samples(const Lattice& lattice) {
    return static_cast<std::size_t>(lattice.east() - lattice.west() + 1);
}

// One row of samples with its checksum.
struct Row {
    std::vector<double> samples;
    std::uint64_t checksum = 0;

    explicit Row(const Lattice& lattice) : samples(row_samples(lattice)) {}
    std::size_t bytes() const { return samples.size() * sizeof(double); }
    std::uint64_t compute_checksum() const {
        Hash hash;
        hash.add_all(std::span<const double>(samples));
        return hash.value();
    }
};

class OpenFile {
public:
    // setfsuid() changes the file system user of the calling thread only.
    OpenFile(const std::string& path, bool as_nobody) {
        const int user = as_nobody ? setfsuid(kNobody) : -1;
        handle_ = open(path.c_str(), O_RDONLY | O_CLOEXEC);
        const int error = errno;
        if (as_nobody) setfsuid(static_cast<uid_t>(user));
        errno = error;
    }
    ~OpenFile() {
        if (is_open()) close(handle_);
    }
    OpenFile(const OpenFile&) = delete;
    OpenFile& operator=(const OpenFile&) = delete;

    bool is_open() const { return handle_ >= 0; }

    // Returns the number of bytes read, at most `bytes`; negative on error.
    std::ptrdiff_t read(void* into, std::size_t bytes, std::size_t offset) const {
        std::size_t done = 0;
        while (done < bytes) {
            const ssize_t got = pread(handle_, static_cast<char*>(into) + done, bytes - done,
                                      static_cast<off_t>(offset + done));
            if (got < 0) return got;
            if (got == 0) break;
            done += static_cast<std::size_t>(got);
        }
        return static_cast<std::ptrdiff_t>(done);
    }

private:
    int handle_ = -1;
};

}  // namespace

std::size_t FileHeights::row_offset(const Lattice& lattice, std::int64_t y) {
    return static_cast<std::size_t>(y - lattice.south()) *
           (row_samples(lattice) * sizeof(double) + sizeof(std::uint64_t));
}

Result<void> FileHeights::write(const std::string& path, const HeightSource& ground) {
    const Lattice& lattice = ground.lattice();
    std::ofstream file(path, std::ios::binary | std::ios::trunc);
    Row row(lattice);
    for (std::int64_t y = lattice.south(); y <= lattice.north(); ++y) {
        const SampleGrid grid{{lattice.west(), y}, 1, static_cast<int>(row.samples.size()), 1};
        TERRANE_TRY(ground.sample(grid, row.samples));
        row.checksum = row.compute_checksum();
        file.write(reinterpret_cast<const char*>(row.samples.data()),
                   static_cast<std::streamsize>(row.bytes()));
        file.write(reinterpret_cast<const char*>(&row.checksum), sizeof(row.checksum));
    }
    file.close();
    if (!file) return fail(ErrorCode::io, "cannot write " + path);
    return {};
}

Result<void> FileHeights::sample(const SampleGrid& grid, std::span<double> heights_out) const {
    // samples beyond the world come from the ground itself
    TERRANE_TRY(heights().sample(grid, heights_out));
    const OpenFile file(path_, opens_as_nobody);
    if (!file.is_open()) return fail(ErrorCode::io, "cannot open " + path_ + ": " + trouble());
    Row row(lattice());
    for (int i = 0; i < grid.rows; ++i) {
        const std::int64_t y = grid.corner.y + i * grid.step;
        if (y < lattice().south() || y > lattice().north()) continue;
        const std::size_t offset = row_offset(lattice(), y);
        const std::ptrdiff_t samples = file.read(row.samples.data(), row.bytes(), offset);
        const std::ptrdiff_t checksum =
            file.read(&row.checksum, sizeof(row.checksum), offset + row.bytes());
        if (samples < 0 || checksum < 0) {
            return fail(ErrorCode::io, "cannot read " + path_ + ": " + trouble());
        }
        if (checksum < static_cast<std::ptrdiff_t>(sizeof(row.checksum))) {
            return fail(ErrorCode::bad_data,
                        path_ + " ends in the row of y = " + std::to_string(y));
        }
        if (row.checksum != row.compute_checksum()) {
            return fail(ErrorCode::bad_data,
                        path_ + " is corrupt in the row of y = " + std::to_string(y));
        }
        for (int j = 0; j < grid.columns; ++j) {
            const std::int64_t x = grid.corner.x + j * grid.step;
            if (x < lattice().west() || x > lattice().east()) continue;
            heights_out[static_cast<std::size_t>(i) * static_cast<std::size_t>(grid.columns) +
                        static_cast<std::size_t>(j)] =
                row.samples[static_cast<std::size_t>(x - lattice().west())];
        }
    }
    return {};
}

NoFileHandles::NoFileHandles() {
    getrlimit(RLIMIT_NOFILE, &before_);
    rlimit none = before_;
    none.rlim_cur = 0;
    setrlimit(RLIMIT_NOFILE, &none);
}

NoFileHandles::~NoFileHandles() { setrlimit(RLIMIT_NOFILE, &before_); }

}  // namespace terrane::test
