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

/// The properties that a HeightSource guarantees. Everything that Terrane certifies depends on them.
enum class SourceLaw : std::uint8_t {
    valid_lattice,  ///< lattice.validate() accepts the lattice; the extent is finite and not empty
    answers,        ///< no call fails or throws
    finite,         ///< no NaN, no infinite height, no negative bound; flags are bits of CellFlag
    fits_quanta,    ///< a sample is within kMostHeight and kMostQuanta quanta
    height,         ///< height() equals sample() at lattice points, to 1e-9 m
    vertex_bound,   ///< the surface is within vertex_bounds() of each vertex's diamond
    cell_bound,     ///< the surface is within cell_bounds() of each cell's two triangles
    nesting,        ///< a vertex's bound is at least the bounds of its children
    no_vertex,      ///< vertex_bounds() is 0 at points that are not vertices of the spacing
    interval,       ///< interval() contains all heights over the rectangle
    rise_bound,     ///< rise_bound() holds between any two points, and does not decrease
    window,         ///< a sample, bound or flag has the same bits in every grid that contains it
    levels,         ///< a coarse sample is bit-identical to the fine sample at that point
    mesh_bounds,    ///< mesh_bounds() is bit-identical to vertex_bounds() and cell_bounds()
    repeatable,     ///< repeated calls give the same bits, in any order
    threads,        ///< concurrent calls give the same bits
};
inline constexpr std::size_t kSourceLawCount = 16;  ///< number of laws

/// The enumerator's name, as in the report.
std::string_view name_of(SourceLaw law);

/// Settings of check_source(). Larger numbers find rarer faults and take longer.
struct SourceCheckSettings {
    std::uint64_t seed = 1;  ///< of random positions and points; the same seed makes the same calls
    int places = 12;         ///< number of grids per spacing, some on the region's edges, 1 to 1e6
    int points = 16;  ///< random points in each triangle, 1 to 1e6; 12 fixed points are added
    /// Coarsest level whose spacing is checked, 0 to the finest level; larger values stand for the finest. Level 0
    /// includes the coarser vertices of root squares.
    int first_level = 0;
    int last_level = 24;  ///< finest level checked; range as for first_level
    /// Part of the world to check, metres; absent: the part of the extent that is inside the world.
    std::optional<WorldRect> region = std::nullopt;
    /// Largest accepted ratio of a vertex's bound to its parent's bound at the next coarser spacing, >= 1. 1: exactly
    /// nested. Terrane's own fractals need 1.5; all its other sources pass with 1.
    double nesting_slack = 1.5;
};

/// A violation of a law.
struct SourceViolation {
    SourceLaw law = SourceLaw::answers;  ///< the violated law
    double x = 0.0, y = 0.0;             ///< world position, metres
    /// Level of the grid's spacing; -6 to -1 for the spacings of vertices that are coarser than a root square's
    /// samples.
    int level = 0;
    double claimed = 0.0;   ///< the source's answer or bound, metres
    double measured = 0.0;  ///< the measured value, metres
    std::string what;       ///< the object that was checked, such as "cell of side 4 m"
};

/// The result of checking one law.
struct SourceLawReport {
    static constexpr std::size_t kMostWorst = 3;  ///< most violations reported per law
    std::uint64_t checks = 0;                     ///< answers checked
    std::uint64_t broken = 0;                     ///< answers that violate the law
    std::vector<SourceViolation> worst;  ///< at most kMostWorst; largest measured - claimed first
};

/// What check_source() found.
struct SourceReport {
    std::uint64_t seed = 0;                             ///< of the random positions
    std::array<SourceLawReport, kSourceLawCount> laws;  ///< by SourceLaw
    /// Largest ratio of a measured deviation to the bound of its triangle. If it is far below 1, the bounds are looser
    /// than necessary, which costs triangles.
    double tightest = 0.0;

    /// The report of one law.
    const SourceLawReport& of(SourceLaw law) const { return laws[static_cast<std::size_t>(law)]; }
    /// Whether no law is violated.
    bool is_clean() const;
    /// Checks made, over all laws.
    std::uint64_t checks() const;
    /// Checks that failed, over all laws.
    std::uint64_t violations() const;
};

/// Checks the laws of a source by sampling: a violation is a proof, a clean report is not.
///
/// Positions are random in the region, on its edges and at its corners. At each position, one grid of each spacing is
/// read; deviations are measured by height() inside the triangles, by hill climbing from random points.
///
/// Fails:     invalid_argument for settings out of range, or a region outside the world
/// Threads:   any; starts some of its own to check concurrent calls
/// Cost:      about 20,000 heights per position and level; about a second for a fractal with 16 levels
Result<SourceReport> check_source(const HeightSource& source,
                                  const SourceCheckSettings& settings = {});

/// A report as text: one line if it is clean; else one line per violated law, followed by its worst violations. Ends
/// with a newline.
std::string to_text(const SourceReport& report);

}  // namespace terrane
