// SPDX-License-Identifier: MIT
#include "gl/arithmetic_probe.h"

#include "gl/gl_object.h"
#include "gl/shader.h"

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace terrane::internal {
namespace {

constexpr std::size_t kProbes = 4096, kGroup = 64;
using Probe = std::array<std::uint32_t, 4>;
using Results = std::array<std::uint32_t, 10>;

// The results of lod_probe.comp on the CPU.
Results expected(const Probe& probe) {
    const auto a = std::bit_cast<float>(probe[0]), b = std::bit_cast<float>(probe[1]);
    const auto c = std::bit_cast<float>(probe[2]);
    const auto bits = [](float value) { return std::bit_cast<std::uint32_t>(value); };
    const double x = static_cast<double>(a) + static_cast<double>(b) * 0.1;
    const double y = static_cast<double>(c) - static_cast<double>(b) * 0.3;
    const auto product = std::bit_cast<std::uint64_t>(x * y);
    const auto sum = std::bit_cast<std::uint64_t>(x + y);
    return {bits(a * b),
            bits(a + b),
            bits(a - b),
            bits(a * b + c),
            static_cast<std::uint32_t>(product),
            static_cast<std::uint32_t>(product >> 32),
            static_cast<std::uint32_t>(sum),
            static_cast<std::uint32_t>(sum >> 32),
            bits(static_cast<float>(x + y)),
            bits(static_cast<float>(static_cast<std::int32_t>(probe[3])))};
}

// Floats of 2^-32 to 2^32 of both signs, and words, from a linear congruential generator.
std::vector<Probe> make_probes() {
    std::uint64_t state = 1;
    const auto next = [&state] {
        state = state * 6364136223846793005u + 1442695040888963407u;
        return static_cast<std::uint32_t>(state >> 32);
    };
    std::vector<Probe> probes(kProbes);
    for (Probe& probe : probes) {
        for (std::size_t i = 0; i < 3; ++i) {
            const std::uint32_t exponent = 127 - 32 + next() % 64;
            probe[i] = (next() & 0x807fffffu) | exponent << 23;
        }
        probe[3] = next();
    }
    return probes;
}

}  // namespace

Result<void> probe_arithmetic() {
    TERRANE_TRY(const GlProgram program, make_compute_program("lod_probe", lod_probe_comp));
    const std::vector<Probe> probes = make_probes();
    const GlBuffer in = make_buffer(), out = make_buffer();
    glNamedBufferStorage(in.name(), sizeof(Probe) * kProbes, probes.data(), 0);
    glNamedBufferStorage(out.name(), sizeof(Results) * kProbes, nullptr, 0);
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, in.name());
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 1, out.name());
    glUseProgram(program.name());
    glDispatchCompute(kProbes / kGroup, 1, 1);
    glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    std::vector<Results> results(kProbes);
    glGetNamedBufferSubData(out.name(), 0, sizeof(Results) * kProbes, results.data());
    TERRANE_TRY(check_gl("probe the device's arithmetic"));
    constexpr std::array<const char*, 10> kOperations{
        "product",        "sum",        "difference", "product and sum",   "double product",
        "double product", "double sum", "double sum", "double as a float", "integer as a float"};
    for (std::size_t i = 0; i < kProbes; ++i) {
        const Results wanted = expected(probes[i]);
        for (std::size_t k = 0; k < wanted.size(); ++k) {
            if (results[i][k] == wanted[k]) continue;
            return fail(ErrorCode::device_unavailable,
                        "the device does not round as IEEE 754: " + std::string(kOperations[k]));
        }
    }
    return {};
}

}  // namespace terrane::internal
