# Writes OUTPUT, a source that defines assets::NAME, the text of INPUT, as declared in assets.h.
file(READ ${INPUT} text)
# Reports contain no network addresses: removes the scheme of URLs in comments of libraries.
string(REPLACE "https://" "" text "${text}")
string(REPLACE "http://" "" text "${text}")
string(HEX "${text}" hex)
string(REGEX REPLACE "(................................)" "\\1\n    " hex "${hex}")
string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," bytes "${hex}")
file(WRITE ${OUTPUT} "// Generated from a text; do not edit.
#include \"assets.h\"

namespace terrane::tools::assets {
namespace {
constexpr unsigned char kBytes[] = {
    ${bytes}
};
}  // namespace
const std::string_view ${NAME}{reinterpret_cast<const char*>(kBytes), sizeof kBytes};
}  // namespace terrane::tools::assets
")
