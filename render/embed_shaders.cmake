# Writes OUTPUT, a source that defines the text of each of SHADERS: terrain.vert becomes
# terrane::internal::terrain_vert.
set(text "// Generated from the shaders; do not edit.\n#include \"gl/shader.h\"\n\nnamespace terrane::internal {\n")
foreach(shader IN LISTS SHADERS)
    get_filename_component(name ${shader} NAME)
    string(REPLACE "." "_" name ${name})
    file(READ ${shader} body)
    string(APPEND text "const std::string_view ${name} = R\"glsl(${body})glsl\";\n")
endforeach()
string(APPEND text "}  // namespace terrane::internal\n")
file(WRITE ${OUTPUT} "${text}")
