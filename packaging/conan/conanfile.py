"""Clarus's libraries as a Conan 2 package: `conan create packaging/conan`, from the tree's root.

Libraries that it is made of come from the system's packages, as they do in every other build: OpenCL's loader, CLBlast, fmt. Conan
checks that they are there, and with `-c tools.system.package_manager:mode=install` installs them."""
import os
import re

from conan import ConanFile
from conan.tools.build import check_min_cppstd
from conan.tools.cmake import CMake, CMakeToolchain, cmake_layout
from conan.tools.files import copy, load
from conan.tools.system.package_manager import Apt

TREE = os.path.join("..", "..")


class Clarus(ConanFile):
    name = "clarus"
    description = "Neural supersampling for real-time rendering on any OpenCL device"
    license = "Apache-2.0"
    topics = ("opencl", "super-resolution", "rendering")
    settings = "os", "compiler", "build_type", "arch"

    def set_version(self):
        header = load(self, os.path.join(self.recipe_folder, TREE, "host/include/clarus/version.h"))
        self.version = re.search(r'CLARUS_VERSION_STRING "(.*)"', header).group(1)

    def export_sources(self):
        tree = os.path.join(self.recipe_folder, TREE)
        for name in ("CMakeLists.txt", "LICENSE"):
            copy(self, name, tree, self.export_sources_folder)
        for folder in ("cmake", "host", "kernels", "pipelines", "bench"):
            copy(self, f"{folder}/*", tree, self.export_sources_folder)

    def layout(self):
        cmake_layout(self)

    def validate(self):
        check_min_cppstd(self, 20)

    def system_requirements(self):
        Apt(self).install(["pkg-config", "ocl-icd-opencl-dev", "opencl-clhpp-headers", "libclblast-dev", "libfmt-dev", "libimath-dev",
                           "nlohmann-json3-dev", "libxxhash-dev"])

    def generate(self):
        toolchain = CMakeToolchain(self)
        toolchain.cache_variables["CLARUS_TOOL"] = False
        toolchain.generate()

    def build(self):
        cmake = CMake(self)
        cmake.configure()
        cmake.build()

    def package(self):
        CMake(self).install()

    def package_info(self):
        # The tree's own CMake package is the one that find_package finds.
        self.cpp_info.set_property("cmake_find_mode", "none")
        self.cpp_info.builddirs = [os.path.join("lib", "cmake", "clarus")]
