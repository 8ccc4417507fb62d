// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/height_source.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace terrane {

/// What a HeightSource promises. Everything that Terrane certifies rests on these.
enum class SourceLaw : std::uint8_t {
    valid_lattice,  ///< check(lattice) accepts the lattice; the extent is finite and not empty
    answers,        ///< no question fails, none throws
    finite,         ///< no NaN, no infinite height, no negative bound; flags are bits of CellFlag
    fits_quanta,    ///< a sample is within kMostHeight and kMostQuanta quanta
    height,         ///< height() is sample() at lattice points, to 1e-9 m
    vertex_bound,   ///< the surface is within vertex_bounds() of each vertex's diamond
    cell_bound,     ///< the surface is within cell_bounds() of each cell's two triangles
    nesting,        ///< bounds of vertices are at least those of the vertices below them
    no_vertex,      ///< vertex_bounds() is 0 at points that are no vertices of the spacing
    interval,       ///< interval() contains every height over the rectangle
    rise_bound,     ///< rise_bound() is not exceeded between two points, and does not decrease
    window,         ///< a sample, bound or flag has the same bits in every grid that contains it
    levels,         ///< a coarse sample is the fine sample at that place, bit for bit
    mesh_bounds,    ///< mesh_bounds() has the bits of vertex_bounds() and cell_bounds()
    repeatable,     ///< the same question again has the same bits, in another order too
    threads,        ///< the same question has the same bits on several threads at once
};
inline constexpr std::size_t kSourceLawCount = 16;

/// The enumerator's own name, as the report prints it.
std::string_view name_of(SourceLaw law);

/// How much of a source is checked. More of everything finds rarer faults and takes longer.
struct SourceCheckSettings {
    std::uint64_t seed = 1;  ///< of places and points: the same seed asks the same questions
    int places = 12;  ///< grids of each spacing, those on the region's edges included, 1 to 1e6
    int points = 16;  ///< random points in each triangle, 1 to 1e6; 12 more are always tried
    /// Levels whose spacings are checked, 0 to the finest; larger than that is as the finest. With level 0
    /// come the coarser vertices of root squares.
    int first_level = 0;
    int last_level = 24;
    /// Part of the world that is checked, metres; absent: the extent, as far as the world has it.
    std::optional<WorldRect> region = std::nullopt;
    /// How much larger than its parent's the bound of a vertex of the next finer spacing may be, >= 1. 1: exactly
    /// nested. Terrane's own fractals need 1.5; all other sources of Terrane pass with 1.
    double nesting_slack = 1.5;
    int threads = 4;       ///< that ask at once, 1 to 64
    std::size_t kept = 3;  ///< violations of each law that are kept, the worst first
};

/// One place where a law is broken.
struct SourceViolation {
    SourceLaw law = SourceLaw::answers;
    double x = 0.0, y = 0.0;  ///< world place, metres
    /// Of the grid's spacing; below 0, for spacings of vertices coarser than a root's samples, down to -6.
    int level = 0;
    double claimed = 0.0;   ///< what the source said, metres: of a bound the bound
    double measured = 0.0;  ///< what was found instead, metres
    std::string what;       ///< the thing that was asked, such as "cell of side 4 m"
};

/// What became of one law.
struct SourceLawReport {
    std::uint64_t checks = 0;
    std::uint64_t broken = 0;
    std::vector<SourceViolation> worst;  ///< at most `kept`; largest measured - claimed first
};

struct SourceReport {
    std::uint64_t seed = 0;
    std::array<SourceLawReport, kSourceLawCount> laws;  ///< by SourceLaw
    /// Largest deviation that was measured over the bound of its triangle. Far below 1 in all places: bounds
    /// are looser than they need be, and cost triangles.
    double tightest = 0.0;

    const SourceLawReport& of(SourceLaw law) const { return laws[static_cast<std::size_t>(law)]; }
    bool is_clean() const;
    std::uint64_t checks() const;
    std::uint64_t violations() const;
};

/// Tries whether a source keeps its promises, by sampling: a clean report is no proof, a violation is one.
///
/// Places are random over the region, and on its edges and corners. At each, and for each spacing, a grid is
/// asked for; deviations are measured by height() inside the triangles, from random points on uphill.
///
/// Fails with invalid_argument for settings out of range, or a region that misses the world.
/// Threads:   any; starts `threads` of its own
/// Cost:      some 20,000 heights for each place and level; a second or so for a fractal with 16 levels
Result<SourceReport> check_source(const HeightSource& source,
                                  const SourceCheckSettings& settings = {});

/// What a person reads: one line for a clean report; else one for each law that is broken, with the worst
/// places below it. Ends with a newline.
std::string to_text(const SourceReport& report);

}  // namespace terrane
