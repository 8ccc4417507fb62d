// SPDX-License-Identifier: MIT
#pragma once

#include "program/progress.h"

#include <terrane/base/result.h>

#include <cstdint>
#include <cstdio>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace terrane::tools {

/// A new file for incomplete content. For a destination PATH its name is the first of PATH.partial, PATH.partial1 and
/// so on that no file has. The destructor removes the file unless it was renamed.
class TemporaryFile {
public:
    /// Fails with io, naming `path`, if no file can be created in its folder.
    static Result<TemporaryFile> beside(const std::string& path);

    TemporaryFile(TemporaryFile&& other) noexcept;
    TemporaryFile& operator=(TemporaryFile&&) = delete;
    ~TemporaryFile();

    const std::string& path() const { return path_; }
    /// The file, open for writing from its beginning.
    std::FILE* stream() const { return stream_; }
    /// Closes the stream.
    /// @return 0, or the errno of a failed flush, for instance on a full disk
    int close();

    /// Closes the stream and renames the file. Call once.
    ///
    /// @param replaces whether to replace an existing file; if not, its presence is the error EEXIST
    /// @return 0; or an errno, in which case the destructor removes the temporary file
    int rename_to(const std::string& path, bool replaces);

private:
    TemporaryFile(std::string path, std::FILE* stream);

    std::string path_;  // "" after the rename
    std::FILE* stream_ = nullptr;
    std::unique_ptr<RemovedIfKilled> if_killed_;
};

/// Name of the list of files that runs wrote into a folder.
inline constexpr const char* kFileListName = "terrane-files.txt";

/// Name of a frame's picture in an output folder: frame_000042.png.
std::string frame_name(std::size_t frame);
bool is_frame_name(const std::string& name);

/// "cannot write '<path>': <why>" with the text of an errno.
tl::unexpected<Error> cannot_write(const std::string& path, int cause);

/// A folder for the output files of a run. The list kFileListName in it holds the name, size and content hash of every
/// file written by a run. A listed file with unchanged content belongs to an earlier run, and the next run removes it.
/// Every other file, even a listed one whose content has changed, belongs to the user: it is never removed or replaced.
///
/// For the lifetime of the object no other run can use the folder (a lock on the list, if the file system supports
/// locks).
class OutputFolder {
public:
    /// Creates the folder if necessary, and checks for name clashes. Removes no files. Returns null for an empty path.
    ///
    /// @param names      files that the run may write
    /// @param has_frames whether the run may also write frame_000000.png and so on
    ///
    /// Fails with io if the folder cannot be created, the list is invalid or cannot be written, a file of the user has
    /// a name that the run may write (the message names it), or another run uses the folder.
    static Result<std::shared_ptr<OutputFolder>> open(const std::string& path,
                                                      std::vector<std::string> names,
                                                      bool has_frames = false);
    OutputFolder(const OutputFolder&) = delete;
    OutputFolder& operator=(const OutputFolder&) = delete;
    /// Removes the list if no file was recorded.
    ~OutputFolder();

    const std::string& path() const { return path_; }
    std::string path_of(const std::string& name) const { return path_ + "/" + name; }

    /// Removes the files of earlier runs. Fails with io.
    Result<void> clear();

    /// Adds the file `name` to the list, with the size and hash of `written_path`: the file itself, or a temporary file
    /// that will be renamed to it. Fails with io.
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

/// A file that appears under its name only when it is complete: its content is written to a temporary file in the same
/// folder, which commit() renames. Without commit() the temporary file is removed. A pipe or a device (/dev/stdout) is
/// written directly.
class OutputFile {
public:
    /// @param place a path named by the user, where an existing file is replaced; or a name in an output folder, to
    ///              whose list commit() adds the file
    ///
    /// Fails with io if the file cannot be created.
    static Result<OutputFile> create(const OutputPlace& place);

    OutputFile(OutputFile&& other) noexcept;
    OutputFile& operator=(OutputFile&&) = delete;
    ~OutputFile();

    /// Appends. An error, for instance a full disk, is stored and reported by check() and commit().
    void write(std::string_view bytes);
    /// Whether a write has failed, so that a long command can stop early.
    bool has_failed() const { return failed_errno_ != 0; }
    /// Fails with io, naming the path and the cause, if a write has failed.
    Result<void> check() const;

    /// Completes the file and renames it to its final name. Fails with io, naming the path and the cause. Call once.
    Result<void> commit();

private:
    OutputFile(OutputPlace place, std::optional<TemporaryFile> temporary, std::FILE* direct);
    std::FILE* stream() const { return direct_ != nullptr ? direct_ : temporary_->stream(); }

    OutputPlace place_;
    std::optional<TemporaryFile> temporary_;
    std::FILE* direct_ = nullptr;  ///< stream of a pipe or a device
    int failed_errno_ = 0;
};

/// Writes a whole file. Fails as OutputFile.
Result<void> write_file(const OutputPlace& place, std::string_view bytes);

}  // namespace terrane::tools
