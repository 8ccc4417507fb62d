// SPDX-License-Identifier: MIT
#include "flight/film.h"

#include "program/output_file.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

extern char** environ;

namespace terrane::tools {
namespace {

constexpr const char* kProgram = "ffmpeg";

class Descriptor {
public:
    Descriptor() = default;
    explicit Descriptor(int number) : number_(number) {}
    Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
    Descriptor& operator=(Descriptor&& other) noexcept {
        std::swap(number_, other.number_);
        return *this;
    }
    ~Descriptor() { close(); }
    void close() {
        if (number_ >= 0) ::close(number_);
        number_ = -1;
    }
    int number() const { return number_; }

private:
    int number_ = -1;
};

struct FileCloser {
    void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, FileCloser>;

// The last line of a file that another process wrote.
std::string last_line(std::FILE* file) {
    std::rewind(file);
    std::string last, line;
    for (int c = std::fgetc(file); c != EOF; c = std::fgetc(file)) {
        if (c != '\n') {
            line.push_back(static_cast<char>(c));
        } else if (!line.empty()) {
            last = std::exchange(line, {});
        }
    }
    return line.empty() ? last : line;
}

std::vector<std::string> make_arguments(const std::string& part, int width_px, int height_px,
                                        double frames_per_second) {
    const std::string size = std::to_string(width_px) + "x" + std::to_string(height_px);
    return {kProgram, "-nostdin", "-hide_banner", "-loglevel", "error", "-y",
            // input
            "-f", "rawvideo", "-pixel_format", "rgb24", "-video_size", size, "-framerate",
            std::to_string(frames_per_second), "-i", "pipe:0",
            // output: BT.709, the colour space that players assume for this size
            "-vf", "scale=out_color_matrix=bt709:out_range=tv", "-colorspace", "bt709",
            "-color_primaries", "bt709", "-color_trc", "bt709", "-an", "-c:v", "libx264", "-preset",
            "veryfast", "-crf", "18", "-pix_fmt", "yuv420p", "-movflags", "+faststart",
            // with a protocol prefix no file name is parsed as an option
            "-f", "mp4", "file:" + part};
}

// Starts ffmpeg with stdin `input` and stderr `complaints`. Returns 0 or an errno.
int start(const std::vector<std::string>& arguments, int input, int complaints,
          pid_t& process_out) {
    std::vector<char*> pointers;
    // posix_spawn does not modify the arguments
    for (const std::string& argument : arguments) {
        pointers.push_back(const_cast<char*>(argument.c_str()));
    }
    pointers.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    if (const int error = posix_spawn_file_actions_init(&actions); error != 0) return error;
    posix_spawn_file_actions_adddup2(&actions, input, STDIN_FILENO);
    posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
    posix_spawn_file_actions_adddup2(&actions, complaints, STDERR_FILENO);
    posix_spawnattr_t attributes;
    int error = posix_spawnattr_init(&attributes);
    if (error == 0) {
        posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
        posix_spawnattr_setpgroup(&attributes, 0);  // a new group: Ctrl-C does not end it
        error =
            posix_spawnp(&process_out, kProgram, &actions, &attributes, pointers.data(), environ);
        posix_spawnattr_destroy(&attributes);
    }
    posix_spawn_file_actions_destroy(&actions);
    return error;
}

}  // namespace

struct Film::State {
    explicit State(OutputPlace to) : place(std::move(to)) {}

    OutputPlace place;
    std::optional<TemporaryFile> part;
    int width_px = 0, height_px = 0;
    int patience_s = kPatience_s;
    std::size_t frame_count = 0;
    pid_t process = -1;
    Descriptor
        frames;  // a socket: with MSG_NOSIGNAL a write to a dead process is an error, not a signal
    File complaints;

    State(const State&) = delete;
    State& operator=(const State&) = delete;
    ~State() { stop(); }

    void stop() {
        frames.close();
        if (process < 0) return;
        kill(-process, SIGKILL);  // the process group: ffmpeg and its children
        wait();
    }

    std::string is_silent() const {
        return "ffmpeg has done nothing for " + std::to_string(patience_s) + " s";
    }

    // As wait(), but returns nothing if ffmpeg neither exits nor writes for patience_s.
    std::optional<int> wait_while_it_works() {
        using Clock = std::chrono::steady_clock;
        Clock::time_point last_change = Clock::now();
        struct stat before {};
        for (;;) {
            int status = -1;
            const pid_t ended = waitpid(process, &status, WNOHANG);
            if (ended == process) {
                process = -1;
                return status;
            }
            struct stat now {};
            if (::stat(part->path().c_str(), &now) == 0 &&
                (now.st_size != before.st_size || now.st_mtim.tv_sec != before.st_mtim.tv_sec ||
                 now.st_mtim.tv_nsec != before.st_mtim.tv_nsec)) {
                before = now;
                last_change = Clock::now();
            }
            if (Clock::now() - last_change > std::chrono::seconds(patience_s)) return std::nullopt;
            std::this_thread::sleep_for(std::chrono::milliseconds(5));
        }
    }

    // Waits until ffmpeg exits. Returns its status from waitpid(), or -1 if waitpid() fails.
    int wait() {
        int status = -1;
        while (waitpid(process, &status, 0) < 0) {
            if (errno != EINTR) {
                status = -1;
                break;
            }
        }
        process = -1;
        return status;
    }

    // Stops ffmpeg. Returns an error with the cause and the last message of ffmpeg.
    tl::unexpected<Error> lost(const std::string& cause) {
        stop();
        part.reset();
        const std::string said = last_line(complaints.get());
        return fail(ErrorCode::io, "cannot write '" + place.path + "': " + cause +
                                       (said.empty() ? "" : ": " + said));
    }
};

Film::Film(std::unique_ptr<State> state) : state_(std::move(state)) {}
Film::Film(Film&&) noexcept = default;
Film& Film::operator=(Film&&) noexcept = default;
Film::~Film() = default;

Result<Film> Film::create(const OutputPlace& place, int width_px, int height_px,
                          double frames_per_second, int patience_s) {
    const std::string& path = place.path;
    if (width_px < 2 || height_px < 2 || width_px % 2 != 0 || height_px % 2 != 0) {
        return fail(ErrorCode::invalid_argument,
                    "the size of a film must be positive and even, got " +
                        std::to_string(width_px) + "x" + std::to_string(height_px));
    }
    if (!(frames_per_second > 0.0 && frames_per_second <= 1000.0)) {
        return fail(ErrorCode::invalid_argument,
                    "a film must have above 0 to 1000 frames a second, got " +
                        std::to_string(frames_per_second));
    }
    auto state = std::make_unique<State>(place);
    state->width_px = width_px;
    state->height_px = height_px;
    state->complaints.reset(std::tmpfile());
    std::array<int, 2> ends{};
    if (state->complaints == nullptr ||
        socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) {
        return fail(ErrorCode::io, "cannot write '" + path + "': " + std::strerror(errno));
    }
    state->patience_s = patience_s;
    state->frames = Descriptor(ends[0]);
    const Descriptor input(ends[1]);
    const timeval patience{.tv_sec = patience_s, .tv_usec = 0};
    setsockopt(ends[0], SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);
    TERRANE_TRY(TemporaryFile part, TemporaryFile::beside(path));
    part.close();  // ffmpeg opens it by its name
    state->part.emplace(std::move(part));
    const int error =
        start(make_arguments(state->part->path(), width_px, height_px, frames_per_second),
              input.number(), fileno(state->complaints.get()), state->process);
    if (error != 0) {
        state->process = -1;
        return fail(ErrorCode::io, "cannot write '" + path + "': " +
                                       (error == ENOENT ? "the program ffmpeg is not installed"
                                                        : std::string("ffmpeg does not start: ") +
                                                              std::strerror(error)));
    }
    return Film(std::move(state));
}

Result<void> Film::add(const Image& frame) {
    State& state = *state_;
    const std::size_t bytes =
        static_cast<std::size_t>(state.width_px) * static_cast<std::size_t>(state.height_px) * 3;
    if (frame.width != state.width_px || frame.height != state.height_px ||
        frame.rgb.size() != bytes) {
        return fail(ErrorCode::invalid_argument,
                    "a frame of '" + state.place.path + "' must have " +
                        std::to_string(state.width_px) + "x" + std::to_string(state.height_px) +
                        " pixels, got " + std::to_string(frame.width) + "x" +
                        std::to_string(frame.height));
    }
    for (std::size_t sent = 0; sent < bytes;) {
        const ssize_t count =
            send(state.frames.number(), frame.rgb.data() + sent, bytes - sent, MSG_NOSIGNAL);
        if (count < 0 && errno == EINTR) continue;
        if (count < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) {
            return state.lost(state.is_silent());
        }
        if (count < 0) return state.lost("ffmpeg takes no more frames");
        sent += static_cast<std::size_t>(count);
    }
    ++state.frame_count;
    return {};
}

Result<void> Film::finish() {
    State& state = *state_;
    if (state.process < 0) return state.lost("it has ended before");
    if (state.frame_count == 0) return state.lost("a film needs a frame");
    state.frames.close();
    const std::optional<int> status = state.wait_while_it_works();
    if (!status) return state.lost(state.is_silent());
    // on a full disk ffmpeg prints an error and still exits with 0
    const bool has_complained = !last_line(state.complaints.get()).empty();
    if (!WIFEXITED(*status) || WEXITSTATUS(*status) != 0 || has_complained) {
        return state.lost("ffmpeg failed");
    }
    if (state.place.folder != nullptr) {
        const Result<void> listed =
            state.place.folder->record(state.part->path(), state.place.name);
        if (!listed) return state.lost(listed.error().message);
    }
    const int cause = state.part->rename_to(state.place.path, state.place.folder == nullptr);
    if (cause != 0) return state.lost(std::strerror(cause));
    return {};
}

std::size_t Film::frame_count() const { return state_->frame_count; }

}  // namespace terrane::tools
