// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/result.h>

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace terrane::tools {

/// Name of the list of files that runs wrote into a folder.
inline constexpr const char* kFileListName = "terrane-files.txt";

/// Name of a picture in a folder: frame_000042.png.
std::string frame_name(std::size_t frame);
bool is_frame_name(const std::string& name);

/// "cannot write '<path>': <why>" with the text of an errno.
tl::unexpected<Error> cannot_write(const std::string& path, int cause);

/// A folder for the output files of a run. The list kFileListName in it holds the name, size and content hash of every
/// file written by a run. A listed file with unchanged content belongs to an earlier run and is replaced; every other
/// file, also a listed one that the user changed, belongs to the user and is neither removed nor overwritten.
///
/// For the lifetime of the object no other run can use the folder (a lock on the list, where the file system has
/// locks).
class OutputFolder {
public:
    /// Creates the folder if necessary, and checks for name clashes. Removes nothing yet.
    ///
    /// @param names      files that the run may write
    /// @param has_frames whether it may write frame_000000.png and so on
    ///
    /// Fails with io where the folder cannot be created, the list is not a list or cannot be written, a file of the
    /// user has a name that the run may write (the message names it), or another run uses the folder.
    static Result<std::shared_ptr<OutputFolder>> open(const std::string& path,
                                                      std::vector<std::string> names,
                                                      bool has_frames);
    OutputFolder(const OutputFolder&) = delete;
    OutputFolder& operator=(const OutputFolder&) = delete;
    /// Removes the list where no file was recorded.
    ~OutputFolder();

    const std::string& path() const { return path_; }
    std::string path_of(const std::string& name) const { return path_ + "/" + name; }

    /// Removes the files of earlier runs. Fails with io.
    Result<void> clear();

    /// Adds a file to the list, with size and hash of `written_path`, which is the file or will be renamed to it. Fails
    /// with io.
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

/// Destination of a file: a path named by the user, or a name in an output folder.
struct OutputPlace {
    std::string path;
    std::shared_ptr<OutputFolder> folder;  ///< null: path named by the user
    std::string name;                      ///< in the folder

    OutputPlace(std::string user_path) : path(std::move(user_path)) {}
    OutputPlace(const char* user_path) : path(user_path) {}
    OutputPlace(std::shared_ptr<OutputFolder> in, std::string file)
        : path(in->path_of(file)), folder(std::move(in)), name(std::move(file)) {}
};

}  // namespace terrane::tools
