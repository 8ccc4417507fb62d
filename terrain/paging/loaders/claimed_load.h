// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/chunk_loader.h>

#include <exception>
#include <new>
#include <string>
#include <utility>

namespace terrane::internal {

/// Names a chunk in errors, such as "chunk (3, -4) of level 5".
inline std::string name_of(const ChunkKey& key) {
    return "chunk (" + std::to_string(key.x) + ", " + std::to_string(key.y) + ") of level " +
           std::to_string(key.level);
}

/// Makes a chunk and attaches its claim; on failure releases the claim.
///
/// @param make returns a Result<std::shared_ptr<const Chunk>>, never null
///
/// Fails:  as make() does; out_of_memory if the chunk is larger than the claim, or it throws std::bad_alloc; io if it
///         throws anything else
/// Throws: nothing
template <class Make>
Result<std::shared_ptr<const Chunk>> load_claimed(const ChunkKey& key, ByteClaim claim,
                                                  const Make& make) noexcept {
    try {
        try {
            Result<std::shared_ptr<const Chunk>> made = make();
            if (!made) return made;
            if (const std::size_t bytes = (*made)->bytes(); bytes > claim.bytes()) {
                return fail(ErrorCode::out_of_memory,
                            name_of(key) + " has " + std::to_string(bytes) +
                                " bytes, more than the " + std::to_string(claim.bytes()) +
                                " that its load has claimed");
            }
            return claimed(std::move(*made), std::move(claim));
        } catch (const std::bad_alloc&) {
            throw;
        } catch (const std::exception& trouble) {
            return fail(ErrorCode::io, name_of(key) + " cannot be read: " + trouble.what());
        } catch (...) {
            return fail(ErrorCode::io, name_of(key) + " cannot be read");
        }
    } catch (...) {
        // std::bad_alloc; the message fits the string's internal buffer
        return fail(ErrorCode::out_of_memory, "out of memory");
    }
}

}  // namespace terrane::internal
