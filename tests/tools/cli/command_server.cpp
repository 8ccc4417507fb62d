// SPDX-License-Identifier: MIT
//
// The program as a server of command lines, for tests with hundreds of short runs: nearly all of a short run is the
// loading of GDAL and OpenVDB, 0.25 s, which is done once here. Every command line runs in a process of its own, forked
// from one that has only been loaded.
//
// A request is a number of words and the words, each ended by a zero byte: files for standard input, output and error,
// then the command line from the program's name on. The answer is a line: the exit code, or minus the signal.
#define main terrane_main
#include "main.cpp"
#undef main

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <iostream>

namespace {

/// Runs a command line; does not return.
[[noreturn]] void run_words(std::vector<std::string> words) {
    for (int number = 0; number < 3; ++number) {
        const int flags = number == 0 ? O_RDONLY : O_WRONLY | O_CREAT | O_TRUNC;
        const int file = open(words[static_cast<std::size_t>(number)].c_str(), flags, 0600);
        if (file < 0 || dup2(file, number) < 0) _exit(127);
        close(file);
    }
    std::vector<char*> arguments;
    for (std::size_t i = 3; i < words.size(); ++i) arguments.push_back(words[i].data());
    arguments.push_back(nullptr);
    const int code = terrane_main(static_cast<int>(words.size()) - 3, arguments.data());
    std::cout.flush();
    std::fflush(nullptr);
    _exit(code);  // destructors of libraries wait for threads that a forked process has not
}

}  // namespace

int main() {
    for (std::string word; std::getline(std::cin, word, '\0');) {
        std::vector<std::string> words(std::stoul(word));
        for (std::string& each : words) std::getline(std::cin, each, '\0');
        if (words.size() < 4 || !std::cin) return 1;
        const pid_t child = fork();
        if (child == 0) run_words(std::move(words));
        int status = 0;
        if (child < 0 || waitpid(child, &status, 0) != child) return 1;
        std::cout << (WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status)) << std::endl;
    }
    return 0;
}
