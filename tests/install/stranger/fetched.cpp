// SPDX-License-Identifier: MIT
// Reads a file of a server that is not there.
#include <terrane/remote/http_files.h>

#include <cstdio>

int main() {
    using namespace terrane;
    // Port 9 of this machine: nothing listens.
    const auto files = open_http("http://127.0.0.1:9/hills/", {.retry_count = 0});
    if (!files) return 1;
    const auto content = (*files)->read_whole("terrain.json", 1000);
    if (content || (*files)->statistics().failures.unreachable != 1) return 1;
    std::puts(content.error().message.c_str());
    return 0;
}
