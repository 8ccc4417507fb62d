# SPDX-License-Identifier: MIT
"""Conan recipe of Terrane's libraries: terrain, collision and scene, and by options what needs libraries of others."""
from conan import ConanFile
from conan.tools.build import check_min_cppstd
from conan.tools.cmake import CMake, CMakeDeps, CMakeToolchain, cmake_layout
from conan.tools.gnu import PkgConfigDeps


class TerraneRecipe(ConanFile):
    name = "terrane"
    version = "0.1.0"
    description = "Ground to see and ground to stand on, for simulators"
    license = "MIT"
    package_type = "library"
    settings = "os", "compiler", "build_type", "arch"
    options = {"shared": [True, False], "store": [True, False], "remote": [True, False], "dem": [True, False], "volume": [True, False],
               "playback": [True, False], "render": [True, False]}
    default_options = {"shared": False, "store": False, "remote": False, "dem": False, "volume": False, "playback": False,
                       "render": False}
    exports_sources = ("CMakeLists.txt", "LICENSE", "*.md", "cmake/*", "base/*", "terrain/*", "collision/*", "playback/*",
                       "render/*", "docs/*", "examples/*")

    def needs_store(self):
        return self.options.store or self.options.remote or self.options.dem or self.options.volume

    def requirements(self):
        # Public headers include these two.
        self.requires("eigen/3.4.0", transitive_headers=True)
        self.requires("tl-expected/1.1.0", transitive_headers=True)
        if self.needs_store():
            self.requires("zstd/1.5.6")
            self.requires("xxhash/0.8.2")
            self.requires("nlohmann_json/3.11.2")
        if self.options.remote:
            self.requires("libcurl/8.6.0")
        if self.options.dem:
            self.requires("gdal/3.8.3")
        if self.options.volume:
            self.requires("openvdb/11.0.0")
        if self.options.playback:
            self.requires("expat/2.6.2")
        if self.options.render:
            self.requires("libepoxy/1.5.10")
            self.requires("libpng/1.6.43")

    def validate(self):
        check_min_cppstd(self, 20)

    def layout(self):
        cmake_layout(self)

    def generate(self):
        CMakeDeps(self).generate()
        PkgConfigDeps(self).generate()  # zstd and epoxy
        toolchain = CMakeToolchain(self)
        for option in ("TOOLS", "TESTS", "WARNINGS_AS_ERRORS"):
            toolchain.variables[f"TERRANE_{option}"] = False
        toolchain.variables["TERRANE_STORE"] = bool(self.needs_store())
        toolchain.variables["TERRANE_REMOTE"] = bool(self.options.remote)
        toolchain.variables["TERRANE_DEM"] = bool(self.options.dem)
        toolchain.variables["TERRANE_VOLUME"] = bool(self.options.volume)
        toolchain.variables["TERRANE_PLAYBACK"] = bool(self.options.playback)
        toolchain.variables["TERRANE_RENDER"] = bool(self.options.render)
        toolchain.generate()

    def build(self):
        cmake = CMake(self)
        cmake.configure()
        cmake.build()

    def package(self):
        CMake(self).install()

    def package_info(self):
        # terraneConfig.cmake is Terrane's own.
        self.cpp_info.set_property("cmake_find_mode", "none")
        self.cpp_info.builddirs.append("lib/cmake/terrane")
