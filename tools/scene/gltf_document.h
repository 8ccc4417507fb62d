// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/math.h>
#include <terrane/base/result.h>

#include <nlohmann/json.hpp>

#include <cstddef>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace terrane::tools::gltf {

using Json = nlohmann::ordered_json;

/// An error of code bad_data.
tl::unexpected<Error> refuse(const std::string& message);

/// An object of the document and its name in messages, such as "accessors[3]". The values at its keys are refused with
/// bad_data if they are of another type.
struct Part {
    const Json* json;
    std::string name;

    /// Null if there is no such key.
    const Json* find(const char* key) const;

    Result<Part> object(const char* key) const;

    /// @param otherwise value if the key is absent; absent for a required key
    Result<std::size_t> number(const char* key, std::optional<std::size_t> otherwise = {}) const;

    /// The index at a key; absent if there is no such key.
    Result<std::optional<std::size_t>> index(const char* key) const;

    /// The list of `count` numbers at a key; of any length if `count` is 0. Empty if there is no such key.
    Result<std::vector<double>> numbers(const char* key, std::size_t count) const;

    /// The list at a key; empty if there is no such key.
    Result<std::vector<std::size_t>> indices(const char* key) const;

    /// An extension of this object; null if it has none of that name.
    const Json* extension(const char* key) const;
};

/// The message about a part whose data only an extension can decompress.
std::string compressed(const Part& part, const char* extension);

/// Numbers of an accessor: `width` for each element.
struct Elements {
    std::size_t count = 0, width = 1;
    std::vector<double> values;

    Eigen::Vector3d vector(std::size_t i) const {
        return {values[width * i], values[width * i + 1], values[width * i + 2]};
    }
};

/// The chunks of a .glb file.
struct Chunks {
    std::string_view json;
    std::optional<std::string_view> binary;
};

/// The first two chunks of a .glb file, section 4.4.
Result<Chunks> read_chunks(std::string_view bytes);

/// The JSON of a file and its buffers, which are read when they are first needed. Errors name the part of the document.
class Document {
public:
    /// @param root   the JSON; must outlive this object
    /// @param binary the second chunk of a .glb file, or empty; its bytes must outlive this object
    /// @param folder of the file, for external buffers
    Document(const Json& root, std::optional<std::string_view> binary, std::string folder)
        : root_{&root, ""}, binary_(binary), folder_(std::move(folder)) {}

    const Part& root() const { return root_; }

    /// An element of a list of the document: item("nodes", 2) is nodes[2].
    Result<Part> item(const char* list, std::size_t i) const;

    /// Length of a list of the document; 0 if there is no such list.
    std::size_t count_of(const char* list) const;

    /// The numbers of an accessor, section 3.6.2, whose elements have from `least` to `most_width` components.
    ///
    /// @param most_count largest number of elements: checked before memory is allocated
    Result<Elements> elements(std::size_t index, std::size_t least, std::size_t most_width,
                              std::size_t most_count);

    /// All bytes of a buffer view, valid as long as this object.
    ///
    /// @param user name of the part that needs them
    Result<std::string_view> view_bytes(std::size_t index, const std::string& user);

    /// The bytes that a uri contains or names.
    ///
    /// @param part whose uri it is, for messages
    Result<std::string> read_uri(const Part& part, const std::string& uri) const;

private:
    /// The first byte of `count` elements of `size` bytes, and the distance from one to the next.
    ///
    /// @param part an accessor or a part of one, with bufferView and byteOffset
    Result<std::pair<const char*, std::size_t>> rows(const Part& part, std::size_t count,
                                                     std::size_t size);
    /// @param view the buffer view that needs it
    Result<std::string_view> buffer_bytes(std::size_t index, const Part& view);

    Part root_;
    std::optional<std::string_view> binary_;
    std::string folder_;
    std::map<std::size_t, std::string_view> buffers_;  // those that have been needed
    std::deque<std::string> owned_;                    // their bytes
};

}  // namespace terrane::tools::gltf
