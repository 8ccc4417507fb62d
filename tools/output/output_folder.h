// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/result.h>

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace terrane::tools {

/// The file that lists what runs wrote into a folder.
inline constexpr const char* kFileListName = "terrane-files.txt";

/// Name of a picture in a folder: frame_000042.png.
std::string frame_name(std::size_t frame);
bool is_frame_name(const std::string& name);

/// "cannot write '<path>': <why>" with the text of an errno.
tl::unexpected<Error> cannot_write(const std::string& path, int cause);

/// A folder that a run writes files into. kFileListName in it names every file that a run has written there, with its
/// size and the hash of its content. A file that the list names and that still holds what was written belongs to an
/// earlier run and is replaced; every other file, one that the user changed included, is the user's, and neither
/// removed nor written over.
///
/// While the object lives, no other run may use the folder (a lock on the list, where the file system has locks).
class OutputFolder {
public:
    /// Makes the folder where it is absent, and looks for clashes. Removes nothing yet.
    ///
    /// @param names      files that the run may write
    /// @param has_frames whether it may write frame_000000.png and so on
    ///
    /// Fails with io: where the folder cannot be made, the list in it cannot be written or is not one, a file of the
    /// user's has a name that the run may write (the message names it), or another run uses the folder
    static Result<std::shared_ptr<OutputFolder>> open(const std::string& path,
                                                      std::vector<std::string> names,
                                                      bool has_frames);
    OutputFolder(const OutputFolder&) = delete;
    OutputFolder& operator=(const OutputFolder&) = delete;
    /// Removes the list where nothing was written.
    ~OutputFolder();

    const std::string& path() const { return path_; }
    std::string path_of(const std::string& name) const { return path_ + "/" + name; }

    /// Removes what earlier runs wrote, so that nothing old looks like a part of this one. Fails with io.
    Result<void> clear();

    /// Adds a file to the list: `written_path` holds what the folder's file of that name holds, or will hold after a
    /// rename. Fails with io.
    Result<void> record(const std::string& written_path, const std::string& name);

private:
    struct Entry {
        std::uint64_t size = 0;
        std::uint64_t hash = 0;
        friend bool operator==(const Entry&, const Entry&) = default;
    };
    static Result<Entry> measure(const std::string& path);

    explicit OutputFolder(std::string path) : path_(std::move(path)) {}
    Result<void> open_list();
    Result<void> read_list();
    Result<void> append(const std::string& text);
    bool is_unchanged(const std::string& name, const Entry& entry) const;

    std::string path_;
    int list_ = -1;  // descriptor of the list
    std::map<std::string, Entry> entries_;
};

/// Where a file goes: a path that the user named, or a name in a folder of a run.
struct OutputPlace {
    std::string path;
    std::shared_ptr<OutputFolder> folder;  ///< null: the user named the path
    std::string name;                      ///< in the folder

    OutputPlace(std::string user_path) : path(std::move(user_path)) {}
    OutputPlace(const char* user_path) : path(user_path) {}
    OutputPlace(std::shared_ptr<OutputFolder> in, std::string file)
        : path(in->path_of(file)), folder(std::move(in)), name(std::move(file)) {}
};

}  // namespace terrane::tools
