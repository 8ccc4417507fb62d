// SPDX-License-Identifier: MIT
// A HeightSource of one's own: rows of dunes. check_source() tests whether it keeps the source laws.
#include <terrane/terrain/check_source.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

namespace {

using namespace terrane;

// z = amplitude * wave(x / wavelength), the same for all y.
class Dunes final : public HeightSource {
public:
    Dunes(const Lattice& lattice, const WorldRect& extent, double amplitude, double wavelength)
        : HeightSource(lattice, extent), amplitude_(amplitude), wavelength_(wavelength) {}

    // Parabolas: no sin() of the C library, whose bits differ from machine to machine.
    double height(double x, double /*y*/) const override {
        const double t = x / wavelength_ - std::floor(x / wavelength_);
        const double u = t < 0.5 ? t : t - 0.5;
        const double hump = 16.0 * u * (0.5 - u);  // 0 to 1 and back to 0
        return t < 0.5 ? amplitude_ * hump : -amplitude_ * hump;
    }

    // A function of the integer address alone: a point has the same bits in every grid and level.
    Result<void> sample(const SampleGrid& grid, std::span<double> heights_out) const override {
        std::size_t i = 0;
        for (int row = 0; row < grid.rows; ++row) {
            for (int column = 0; column < grid.columns; ++column, ++i) {
                heights_out[i] = height(lattice().x(grid.corner.x + column * grid.step),
                                        lattice().y(grid.corner.y + row * grid.step));
            }
        }
        return {};
    }

    // The longest edge of a centre's two triangles is the diagonal of a square of side 2 s. For a midpoint it is an
    // edge of such a square.
    Result<void> vertex_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override {
        const double s = lattice().spacing * static_cast<double>(grid.step);
        std::size_t i = 0;
        for (int row = 0; row < grid.rows; ++row) {
            for (int column = 0; column < grid.columns; ++column, ++i) {
                const bool is_centre = row % 2 == 1 && column % 2 == 1;
                const bool is_vertex = row % 2 == 1 || column % 2 == 1;
                const double edge = is_centre ? std::sqrt(8.0) * s : 2.0 * s;
                bounds_out[i] = is_vertex ? bound(edge) : 0.0f;
            }
        }
        return {};
    }

    Result<void> cell_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override {
        const double s = lattice().spacing * static_cast<double>(grid.step);
        std::fill(bounds_out.begin(), bounds_out.end(), bound(std::sqrt(2.0) * s));
        return {};
    }

    HeightInterval interval(const WorldRect& /*rect*/) const override {
        return {-amplitude_, amplitude_};
    }

    // The steepest slope is 8 amplitudes per wavelength.
    double rise_bound(double distance) const override {
        return std::min(2.0 * amplitude_, 8.0 * amplitude_ / wavelength_ * distance);
    }

private:
    // A surface whose second derivative is at most M in every direction leaves its linear interpolation over a
    // right triangle of longest edge l by at most M l^2 / 8 (S. Waldron, The error in linear interpolation at
    // the vertices of a simplex, 1998), and never by more than its range. Rounded up.
    float bound(double edge) const {
        const double second = 32.0 * amplitude_ / (wavelength_ * wavelength_);
        const double most = std::min(2.0 * amplitude_, second * edge * edge / 8.0);
        return std::nextafter(static_cast<float>(most), std::numeric_limits<float>::infinity());
    }

    double amplitude_;
    double wavelength_;
};

}  // namespace

int main() {
    // 2 x 2 root squares around the origin, with a side of 16 km: 128 cells of 0.5 m, doubled 8 times.
    Lattice lattice;
    lattice.spacing = 0.5;
    lattice.finest_level = 8;
    lattice.first_root_x = lattice.first_root_y = -1;
    lattice.root_count_x = lattice.root_count_y = 2;
    const double edge = lattice.root_size();
    const Dunes dunes(lattice, {-edge, -edge, edge, edge}, 12.0, 180.0);

    const Result<SourceReport> report = check_source(dunes);
    if (!report) {
        std::printf("not checked: %s\n", report.error().message.c_str());
        return 1;
    }
    std::printf("%s", to_text(*report).c_str());
    return report->is_clean() ? 0 : 1;
}
