// SPDX-License-Identifier: MIT
#pragma once

#include "remote_files.h"
#include "store/test_files.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace terrane::test {

/// A program that runs until the end of the scope.
class Program {
public:
    Program(std::vector<std::string> words, const std::string& folder, const std::string& output) {
        std::vector<char*> arguments;
        for (std::string& word : words) arguments.push_back(word.data());
        arguments.push_back(nullptr);
        posix_spawn_file_actions_t actions;
        posix_spawn_file_actions_init(&actions);
        posix_spawn_file_actions_addchdir_np(&actions, folder.c_str());
        posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
        posix_spawn_file_actions_addopen(&actions, 1, output.c_str(), O_WRONLY | O_CREAT, 0600);
        posix_spawn_file_actions_addopen(&actions, 2, output.c_str(), O_WRONLY | O_CREAT, 0600);
        if (posix_spawnp(&process_, arguments[0], &actions, nullptr, arguments.data(), environ) !=
            0) {
            process_ = -1;
        }
        posix_spawn_file_actions_destroy(&actions);
    }
    ~Program() {
        if (process_ <= 0) return;
        kill(process_, SIGKILL);
        wait();
    }
    Program(const Program&) = delete;
    Program& operator=(const Program&) = delete;
    bool is_running() const { return process_ > 0; }
    /// The exit status.
    int wait() {
        int status = -1;
        waitpid(std::exchange(process_, -1), &status, 0);
        return status;
    }

private:
    pid_t process_ = -1;
};

/// A server of OpenSSL's program for the files of a folder, with a certificate that nobody trusts.
class TlsServer {
public:
    /// Makes a certificate for a host, and its key. False if there is no openssl.
    bool make_certificate(const std::string& host) {
        const std::string log = folder_.file("openssl.log");
        Program maker(
            {"openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1",
             "-nodes", "-days", "2", "-subj", "/CN=" + host, "-addext",
             "subjectAltName=DNS:" + host, "-keyout", host + ".key", "-out", host + ".pem"},
            folder_.path(), log);
        if (!maker.is_running()) return false;
        EXPECT_EQ(maker.wait(), 0) << read_file(log).data();
        return true;
    }

    /// Starts `openssl s_server` for the files of the folder, and returns its address.
    ///
    /// @param mode -WWW: status 200 and the whole file, without its length. -HTTP: files are whole replies
    std::string serve(const std::string& host, const std::string& mode) {
        const std::string output = folder_.file("server.log");
        server_.reset();
        unlink(output.c_str());
        server_ = std::make_unique<Program>(
            std::vector<std::string>{"openssl", "s_server", "-accept", "127.0.0.1:0", "-cert",
                                     host + ".pem", "-key", host + ".key", mode},
            folder_.path(), output);
        std::string port;
        EXPECT_TRUE(holds_soon([&] {
            const std::string name = "ACCEPT 127.0.0.1:";
            std::ifstream file(output);
            for (std::string line; std::getline(file, line) && !file.eof();) {
                if (line.starts_with(name)) port = line.substr(name.size());
            }
            return !port.empty();
        }));
        return "https://localhost:" + port + "/";
    }

    /// Path of a file of the folder.
    std::string file(const std::string& name) const { return folder_.file(name); }

private:
    TemporaryFolder folder_;
    std::unique_ptr<Program> server_;
};

}  // namespace terrane::test
