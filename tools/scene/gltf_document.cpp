// SPDX-License-Identifier: MIT
#include "scene/gltf_document.h"

#include "program/json_values.h"
#include "scene/mesh_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <tuple>
#include <utility>

namespace terrane::tools::gltf {

tl::unexpected<Error> refuse(const std::string& message) {
    return fail(ErrorCode::bad_data, message);
}

std::string compressed(const Part& part, const char* extension) {
    return fmt::format("{} is compressed by {}, which is not read", part.name, extension);
}

Result<Chunks> read_chunks(std::string_view bytes) {
    const auto word = [&](std::size_t at) {
        std::uint32_t value = 0;
        for (std::size_t i = 4; i-- > 0;)
            value = value << 8 | static_cast<unsigned char>(bytes[at + i]);
        return value;
    };
    constexpr std::uint32_t kJsonChunk = 0x4e4f534a, kBinaryChunk = 0x004e4942;
    if (bytes.size() < 20 || word(8) < 20 || word(8) > bytes.size())
        return refuse("it is no GLB file, or ends early");
    if (word(4) != 2) return refuse(fmt::format("only glTF 2.0 is read, got version {}", word(4)));
    bytes = bytes.substr(0, word(8));
    const std::size_t json_size = word(12);
    if (word(16) != kJsonChunk || json_size > bytes.size() - 20)
        return refuse("its first chunk is no JSON, or ends early");
    const std::string_view json = bytes.substr(20, json_size);
    const std::size_t second = 20 + json_size;
    if (bytes.size() - second < 8 || word(second + 4) != kBinaryChunk)
        return Chunks{json, std::nullopt};
    if (word(second) > bytes.size() - second - 8) return refuse("its second chunk ends early");
    return Chunks{json, bytes.substr(second + 8, word(second))};
}

namespace {

constexpr std::size_t kMostNumber = std::size_t{1} << 40;  // of a count or an offset

struct ComponentType {
    std::size_t size;
    double normalised_by;  // the number that means 1, section 3.11
    double (*value)(const char* raw);
};

template <class Number>
constexpr ComponentType component_type(double normalised_by) {
    return {sizeof(Number), normalised_by, [](const char* raw) {
                std::array<char, sizeof(Number)> bytes{};
                std::copy_n(raw, bytes.size(), bytes.begin());
                if (std::endian::native == std::endian::big) std::ranges::reverse(bytes);
                return static_cast<double>(std::bit_cast<Number>(bytes));
            }};
}

std::optional<ComponentType> component_type_of(std::size_t number) {
    switch (number) {
        case 5120:
            return component_type<std::int8_t>(127.0);
        case 5121:
            return component_type<std::uint8_t>(255.0);
        case 5122:
            return component_type<std::int16_t>(32767.0);
        case 5123:
            return component_type<std::uint16_t>(65535.0);
        case 5125:
            return component_type<std::uint32_t>(4294967295.0);
        case 5126:
            return component_type<float>(1.0);
        default:
            return std::nullopt;
    }
}

/// Replaces "%20" by a space, and so on; a % without two hexadecimal digits stays.
std::string percent_decoded(std::string_view text) {
    std::string made;
    for (std::size_t i = 0; i < text.size(); ++i) {
        unsigned code = 0;
        const char* const digits = text.data() + i + 1;
        if (text[i] == '%' && i + 2 < text.size() &&
            std::from_chars(digits, digits + 2, code, 16).ptr == digits + 2) {
            made += static_cast<char>(code);
            i += 2;
        } else {
            made += text[i];
        }
    }
    return made;
}

std::optional<std::string> base64_decoded(std::string_view text) {
    while (text.ends_with('=')) text.remove_suffix(1);
    constexpr std::string_view kDigits =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::array<int, 256> value_of{};
    value_of.fill(-1);
    for (std::size_t i = 0; i < kDigits.size(); ++i)
        value_of[static_cast<unsigned char>(kDigits[i])] = static_cast<int>(i);
    std::string made;
    made.reserve(text.size() / 4 * 3 + 2);
    std::uint32_t bits = 0;
    int bit_count = 0;
    for (const char digit : text) {
        const int value = value_of[static_cast<unsigned char>(digit)];
        if (value < 0) return std::nullopt;
        bits = bits << 6 | static_cast<std::uint32_t>(value);
        bit_count += 6;
        if (bit_count < 8) continue;
        bit_count -= 8;
        made += static_cast<char>(bits >> bit_count & 0xffu);
    }
    return made;
}

Result<ComponentType> component_of(const Part& part) {
    TERRANE_TRY(const std::size_t number, part.number("componentType"));
    const std::optional<ComponentType> type = component_type_of(number);
    if (type) return *type;
    return refuse(fmt::format("{}.componentType must be one of 5120 to 5126 without 5124, got {}",
                              part.name, number));
}

}  // namespace

const Json* Part::find(const char* key) const {
    const auto at = json->find(key);
    return at == json->end() ? nullptr : &*at;
}

Result<Part> Part::object(const char* key) const {
    const Json* const found = find(key);
    const std::string path = name.empty() ? key : fmt::format("{}.{}", name, key);
    if (found != nullptr && found->is_object()) return Part{found, path};
    return refuse(found == nullptr
                      ? path + " is missing"
                      : fmt::format("{} must be an object, got {}", path, shown(*found)));
}

Result<std::size_t> Part::number(const char* key, std::optional<std::size_t> otherwise) const {
    const Json* const found = find(key);
    if (found == nullptr && otherwise) return *otherwise;
    if (found == nullptr) return refuse(fmt::format("{}.{} is missing", name, key));
    // a whole number may be written as 3.0 (section 3.3)
    if (found->is_number() && found->get<double>() >= 0.0 &&
        found->get<double>() <= static_cast<double>(kMostNumber) &&
        found->get<double>() == std::floor(found->get<double>())) {
        return static_cast<std::size_t>(found->get<double>());
    }
    return refuse(fmt::format("{}.{} must be a whole number from 0 to 2^40, got {}", name, key,
                              shown(*found)));
}

Result<std::optional<std::size_t>> Part::index(const char* key) const {
    if (find(key) == nullptr) return std::optional<std::size_t>();
    TERRANE_TRY(const std::size_t found, number(key));
    return std::optional<std::size_t>(found);
}

Result<std::vector<double>> Part::numbers(const char* key, std::size_t count) const {
    const Json* const found = find(key);
    std::vector<double> list;
    if (found == nullptr) return list;
    bool is_good = found->is_array() && (count == 0 || found->size() == count);
    for (std::size_t i = 0; is_good && i < found->size(); ++i) {
        is_good = (*found)[i].is_number();
        if (is_good) list.push_back((*found)[i].get<double>());
    }
    if (is_good) return list;
    return refuse(fmt::format("{}.{} must be a list of {}numbers, got {}", name, key,
                              count == 0 ? "" : fmt::format("{} ", count), shown(*found)));
}

Result<std::vector<std::size_t>> Part::indices(const char* key) const {
    TERRANE_TRY(const std::vector<double> list, numbers(key, 0));
    std::vector<std::size_t> made;
    for (const double value : list) {
        if (!(value >= 0.0 && value <= 0x1p32 && value == std::floor(value))) {
            return refuse(fmt::format("{}.{} names element {}", name, key, value));
        }
        made.push_back(static_cast<std::size_t>(value));
    }
    return made;
}

const Json* Part::extension(const char* key) const {
    const Json* const all = find("extensions");
    if (all == nullptr || !all->is_object() || !all->contains(key)) return nullptr;
    return &(*all)[key];
}

Result<Part> Document::item(const char* list, std::size_t i) const {
    const Json* const all = root_.find(list);
    const std::size_t count = all != nullptr && all->is_array() ? all->size() : 0;
    if (i >= count) return refuse(fmt::format("it names {}[{}] of {}", list, i, count));
    const std::string name = fmt::format("{}[{}]", list, i);
    if (!(*all)[i].is_object())
        return refuse(fmt::format("{} must be an object, got {}", name, shown((*all)[i])));
    return Part{&(*all)[i], name};
}

std::size_t Document::count_of(const char* list) const {
    const Json* const all = root_.find(list);
    return all != nullptr && all->is_array() ? all->size() : 0;
}

Result<Elements> Document::elements(std::size_t index, std::size_t least, std::size_t most_width,
                                    std::size_t most_count) {
    TERRANE_TRY(const Part accessor, item("accessors", index));
    const Json* const type_name = accessor.find("type");
    constexpr std::array<std::string_view, 4> kTypes = {"SCALAR", "VEC2", "VEC3", "VEC4"};
    const auto* const type =
        type_name == nullptr || !type_name->is_string()
            ? kTypes.end()
            : std::ranges::find(kTypes, type_name->get_ref<const std::string&>());
    Elements made;
    made.width = static_cast<std::size_t>(type - kTypes.begin()) + 1;
    if (made.width < least || made.width > most_width) {
        return refuse(fmt::format("{}.type must be {}{}, got {}", accessor.name, kTypes[least - 1],
                                  most_width > least ? " or VEC4" : "",
                                  type_name == nullptr ? "nothing" : shown(*type_name)));
    }
    TERRANE_TRY(made.count, accessor.number("count"));
    if (made.count > most_count) {
        return refuse(
            fmt::format("{} has {} elements, more than {}", accessor.name, made.count, most_count));
    }
    TERRANE_TRY(const ComponentType component, component_of(accessor));
    const Json* const normalized = accessor.find("normalized");
    if (normalized != nullptr && !normalized->is_boolean())
        return refuse(accessor.name + ".normalized must be true or false");
    const bool is_normalised = normalized != nullptr && normalized->get<bool>();
    const auto value_at = [&](const char* raw) {
        const double value = component.value(raw);
        return is_normalised ? std::max(value / component.normalised_by, -1.0) : value;
    };
    const std::size_t size = made.width * component.size;
    // without a buffer view all are 0
    const char* raw = nullptr;
    std::size_t stride = 0;
    if (accessor.find("bufferView") != nullptr) {
        TERRANE_TRY(std::tie(raw, stride), rows(accessor, made.count, size));
    }
    made.values.assign(made.count * made.width, 0.0);
    for (std::size_t i = 0; raw != nullptr && i < made.count; ++i) {
        for (std::size_t k = 0; k < made.width; ++k)
            made.values[made.width * i + k] = value_at(raw + i * stride + k * component.size);
    }
    if (accessor.find("sparse") == nullptr) return made;

    TERRANE_TRY(const Part sparse, accessor.object("sparse"));
    TERRANE_TRY(const std::size_t changed, sparse.number("count"));
    TERRANE_TRY(const Part places, sparse.object("indices"));
    TERRANE_TRY(const Part values, sparse.object("values"));
    if (changed > made.count) {
        return refuse(
            fmt::format("{} changes {} of {} elements", sparse.name, changed, made.count));
    }
    TERRANE_TRY(const ComponentType place, component_of(places));
    TERRANE_TRY(const auto place_rows, rows(places, changed, place.size));
    TERRANE_TRY(const auto value_rows, rows(values, changed, size));
    for (std::size_t i = 0; i < changed; ++i) {
        const double at = place.value(place_rows.first + i * place_rows.second);
        if (!(at >= 0.0 && at < static_cast<double>(made.count)))
            return refuse(fmt::format("{} names element {} of {}", places.name, at, made.count));
        for (std::size_t k = 0; k < made.width; ++k) {
            made.values[made.width * static_cast<std::size_t>(at) + k] =
                value_at(value_rows.first + i * value_rows.second + k * component.size);
        }
    }
    return made;
}

Result<std::string_view> Document::view_bytes(std::size_t index, const std::string& user) {
    TERRANE_TRY(const Part view, item("bufferViews", index));
    TERRANE_TRY(const std::size_t length, view.number("byteLength"));
    // as an accessor of `length` bytes
    const Json accessor = {{"bufferView", index}};
    TERRANE_TRY(const auto first, rows({&accessor, user}, length, 1));
    return std::string_view(first.first, length);
}

Result<std::pair<const char*, std::size_t>> Document::rows(const Part& part, std::size_t count,
                                                           std::size_t size) {
    TERRANE_TRY(const std::size_t view_index, part.number("bufferView"));
    TERRANE_TRY(const std::size_t offset, part.number("byteOffset", 0));
    TERRANE_TRY(const Part view, item("bufferViews", view_index));
    TERRANE_TRY(const std::size_t buffer_index, view.number("buffer"));
    TERRANE_TRY(const std::size_t view_offset, view.number("byteOffset", 0));
    TERRANE_TRY(const std::size_t view_length, view.number("byteLength"));
    TERRANE_TRY(const std::size_t stride, view.number("byteStride", size));
    if (stride < size || stride > 252 + size) {
        return refuse(
            fmt::format("{}.byteStride must be {} to 252, got {}", view.name, size, stride));
    }
    TERRANE_TRY(const std::string_view bytes, buffer_bytes(buffer_index, view));
    if (view_offset + view_length > bytes.size()) {
        return refuse(fmt::format("{} ends at byte {} of {}", view.name, view_offset + view_length,
                                  bytes.size()));
    }
    const std::size_t needed = count == 0 ? 0 : offset + stride * (count - 1) + size;
    if (needed > view_length) {
        return refuse(fmt::format("{} ends at byte {} of {}, which has {}", part.name, needed,
                                  view.name, view_length));
    }
    return std::pair(bytes.data() + view_offset + offset, stride);
}

Result<std::string_view> Document::buffer_bytes(std::size_t index, const Part& view) {
    if (const auto known = buffers_.find(index); known != buffers_.end()) return known->second;
    TERRANE_TRY(const Part buffer, item("buffers", index));
    TERRANE_TRY(const std::size_t length, buffer.number("byteLength"));
    const Json* const uri = buffer.find("uri");
    std::string_view bytes;
    if (uri != nullptr) {
        if (!uri->is_string()) return refuse(buffer.name + ".uri must be a text");
        TERRANE_TRY(std::string read, read_uri(buffer, uri->get_ref<const std::string&>()));
        bytes = owned_.emplace_back(std::move(read));
    } else if (index == 0 && binary_) {
        bytes = *binary_;
    } else {
        for (const char* coder : {"EXT_meshopt_compression", "KHR_meshopt_compression"}) {
            if (view.extension(coder) != nullptr) return refuse(compressed(view, coder));
        }
        return refuse(buffer.name + " has no uri");
    }
    if (bytes.size() < length) {
        return refuse(fmt::format("{} has {} bytes, fewer than its byteLength {}", buffer.name,
                                  bytes.size(), length));
    }
    return buffers_[index] = bytes.substr(0, length);
}

Result<std::string> Document::read_uri(const Part& part, const std::string& uri) const {
    if (uri.starts_with("data:")) {
        const std::size_t comma = std::min(uri.find(','), uri.size() - 1);
        const std::string_view kind = std::string_view(uri).substr(0, comma);
        const std::string_view data = std::string_view(uri).substr(comma + 1);
        if (!kind.ends_with(";base64")) return percent_decoded(data);
        std::optional<std::string> bytes = base64_decoded(data);
        if (!bytes) return refuse(part.name + ".uri is no base64");
        return *std::move(bytes);
    }
    const std::filesystem::path name(percent_decoded(uri));
    if (uri.find(':') != std::string::npos || !is_path_below(name)) {
        return refuse(fmt::format(
            "{}.uri '{:.60}' is not read: buffers must be in the file's folder or below it",
            part.name, uri));
    }
    Result<std::string> bytes = read_whole_file((std::filesystem::path(folder_) / name).string());
    if (bytes) return bytes;
    return fail(ErrorCode::io, fmt::format("{}: '{}' beside it cannot be read: {}", part.name,
                                           name.string(), bytes.error().message));
}

}  // namespace terrane::tools::gltf
