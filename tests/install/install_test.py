"""What is installed works where it is moved to, and programs outside find it: by CMake and by pkg-config, in C and in C++.

usage: install_test.py BUILD_FOLDER SOURCE_FOLDER CMAKE [COMPONENT...]

Without components, everything that was built is installed."""
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

BUILD, SOURCE = map(os.path.abspath, sys.argv[1:3])
CMAKE = sys.argv[3]
COMPONENTS = sys.argv[4:]
DEVICE = os.environ.get("CLARUS_TEST_DEVICE") or "auto"
RESULT = re.compile(r"640x360, the first pixel is 0\.[1-9]")
# What the library may need: OpenCL, what is built on it, and the languages' own.
NEEDED = {"libOpenCL", "libclblast", "libfmt", "libstdc++", "libm", "libgcc_s", "libc", "ld-linux-x86-64", "ld-linux-aarch64"}
PROJECT = """cmake_minimum_required(VERSION 3.25)
project(outside LANGUAGES {languages})
find_package(clarus 0.1 REQUIRED{components})
{targets}"""
# The tree as a part of another project, which has no need of its programs and tests.
WITHIN = """cmake_minimum_required(VERSION 3.25)
project(around LANGUAGES C CXX)
{inclusion}
add_executable(example readme_example_cpp.cpp)
target_link_libraries(example PRIVATE clarus)
"""


def output_of(*command, **settings):
    result = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, **settings)
    if result.returncode != 0:
        raise AssertionError(f"{' '.join(command)}: {result.returncode}\n{result.stdout}")
    return result.stdout


def found(root, ending):
    """The one file whose path ends so."""
    paths = [os.path.join(folder, name) for folder, _, names in os.walk(root) for name in names]
    matching = [path for path in paths if path.endswith(ending)]
    assert len(matching) == 1, (ending, matching)
    return matching[0]


class Installed(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix="clarus-install-")
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        first = os.path.join(cls.folder, "first")
        for component in COMPONENTS or [None]:
            output_of(CMAKE, "--install", BUILD, "--prefix", first, *(["--component", component] if component else []))
        cls.prefix = os.path.join(cls.folder, "moved", "elsewhere")
        os.makedirs(os.path.dirname(cls.prefix))
        os.rename(first, cls.prefix)
        cls.library = os.path.realpath(found(cls.prefix, "/libclarus.so"))
        cls.environment = {name: value for name, value in os.environ.items()
                           if name not in ("LD_LIBRARY_PATH", "CLARUS_MODEL_PATH", "PKG_CONFIG_PATH")}

    def run_example(self, program, **more):
        self.assertRegex(output_of(program, DEVICE, env={**self.environment, **more}), RESULT)

    def run_static(self, program):
        """A program that contains the library is somewhere else than the models."""
        models = os.path.dirname(found(self.prefix, "/models/enss-s-x2.safetensors"))
        self.run_example(program, CLARUS_MODEL_PATH=models)
        self.assertNotIn("libclarus", output_of("readelf", "-d", program))

    def build(self, name, languages, targets, components=""):
        """A project outside; its example programs are those of docs/integrating.md."""
        folder = os.path.join(self.folder, name)
        os.makedirs(folder)
        for example in ("readme_example_c.c", "readme_example_cpp.cpp"):
            shutil.copy(os.path.join(BUILD, "tests", example), folder)
        with open(os.path.join(folder, "CMakeLists.txt"), "w") as file:
            file.write(PROJECT.format(languages=languages, targets=targets, components=components))
        output_of(CMAKE, "-S", folder, "-B", folder + "/build", "-DCMAKE_PREFIX_PATH=" + self.prefix, env=self.environment)
        output_of(CMAKE, "--build", folder + "/build", env=self.environment)
        return folder + "/build/"

    def test_cmake_from_c(self):
        build = self.build("in_c", "C", "add_executable(shared readme_example_c.c)\n"
                           "target_link_libraries(shared PRIVATE clarus::clarus clarus::share)\n")
        self.run_example(build + "shared")

    def test_cmake_from_cpp(self):
        build = self.build("in_cpp", "CXX", "add_executable(shared readme_example_cpp.cpp)\n"
                           "target_link_libraries(shared PRIVATE clarus::clarus)\n"
                           "add_executable(with_static readme_example_cpp.cpp)\n"
                           "target_link_libraries(with_static PRIVATE clarus::static)\n", " COMPONENTS static")
        self.run_example(build + "shared")
        self.run_static(build + "with_static")

    def test_static_from_c(self):
        build = self.build("static_in_c", "C", "add_executable(with_static readme_example_c.c)\n"
                           "target_link_libraries(with_static PRIVATE clarus::static)\n", " COMPONENTS static")
        self.run_static(build + "with_static")

    def test_within_another_project(self):
        """That it configures, and what would be built: to compile all of it once more takes as long as the first time."""
        for name, inclusion in (
                ("subdirectory", f"add_subdirectory({SOURCE} clarus)"),
                ("fetched", f"include(FetchContent)\nFetchContent_Declare(clarus SOURCE_DIR {SOURCE})\n"
                 "FetchContent_MakeAvailable(clarus)")):
            with self.subTest(name):
                folder = os.path.join(self.folder, name)
                os.makedirs(folder)
                shutil.copy(os.path.join(BUILD, "tests", "readme_example_cpp.cpp"), folder)
                with open(os.path.join(folder, "CMakeLists.txt"), "w") as file:
                    file.write(WITHIN.format(inclusion=inclusion))
                output_of(CMAKE, "-G", "Ninja", "-S", folder, "-B", folder + "/build", env=self.environment)
                steps = output_of("ninja", "-C", folder + "/build", "-t", "commands", "example")
                self.assertIn("api/upscaler.cpp", steps)
                self.assertRegex(steps, r"-o example\b")
                everything = output_of("ninja", "-C", folder + "/build", "-t", "targets", "all")
                self.assertNotIn("clarus_tests:", everything)

    def test_pkg_config(self):
        environment = {**self.environment, "PKG_CONFIG_PATH": os.path.dirname(found(self.prefix, "/clarus.pc"))}
        library_path = os.path.dirname(self.library)
        for name, compiler in (("c.c", ["cc"]), ("cpp.cpp", ["c++", "-std=c++20"])):
            program = os.path.join(self.folder, "by_pkg_config_" + name)
            flags = output_of("pkg-config", "--cflags", "--libs", "clarus", env=environment).split()
            output_of(*compiler, os.path.join(BUILD, "tests", "readme_example_" + name), "-o", program, *flags)
            self.run_example(program, LD_LIBRARY_PATH=library_path)
        program = os.path.join(self.folder, "by_pkg_config_static")
        flags = output_of("pkg-config", "--cflags", "--libs", "clarus-static", env=environment).split()
        output_of("c++", "-std=c++20", os.path.join(BUILD, "tests", "readme_example_cpp.cpp"), "-o", program, *flags)
        self.assertNotIn("libclarus", output_of("readelf", "-d", program))
        self.run_example(program, CLARUS_MODEL_PATH=os.path.dirname(found(self.prefix, "/models/enss-s-x2.safetensors")))
        self.assertIn("-lclarus_share", output_of("pkg-config", "--libs", "clarus-share", env=environment))

    def test_documents_are_where_messages_refer_to(self):
        self.assertTrue(os.path.exists(os.path.join(self.prefix, "share/doc/clarus/docs/choosing-a-model.md")))

    def test_nothing_leads_to_the_build(self):
        for folder, _, names in os.walk(self.prefix):
            for name in names:
                path = os.path.join(folder, name)
                with open(path, "rb") as file:
                    content = file.read()
                for tree in (BUILD, SOURCE):
                    self.assertFalse(tree.encode() in content, f"{path} names {tree}")
                if content.startswith(b"\x7fELF"):
                    self.assertNotRegex(output_of("readelf", "-d", path), "RUNPATH|RPATH")

    def test_bill_of_materials(self):
        with open(os.path.join(self.prefix, "share", "doc", "libclarus0", "sbom.spdx.json")) as file:
            bill = json.load(file)
        self.assertEqual(bill["spdxVersion"], "SPDX-2.3")
        packages = {package["SPDXID"]: package for package in bill["packages"]}
        self.assertEqual(len(packages), len(bill["packages"]))
        for package in packages.values():
            self.assertRegex(package["versionInfo"], r"\d", package["name"])
        depended = {relation["relatedSpdxElement"] for relation in bill["relationships"]}
        self.assertEqual(depended, set(packages))
        self.assertIn("CLBlast", {package["name"] for package in packages.values()})

    def test_library_needs_little(self):
        needed = set(re.findall(r"NEEDED.*\[(.*)\.so\b.*\]", output_of("readelf", "-d", self.library)))
        self.assertLessEqual(needed, NEEDED)

    def test_library_exports_its_interface_alone(self):
        headers = ""
        include = os.path.dirname(found(self.prefix, "/clarus/clarus.h"))
        for name in os.listdir(include):
            with open(os.path.join(include, name)) as file:
                headers += file.read() if name != "share.h" else ""
        functions = set(re.findall(r"^(?!static)\w[\w *]*?\b(clarus_\w+)\(", headers, re.MULTILINE))
        functions -= {"clarus_default_options", "clarus_default_frame"}  # inline
        names = set(re.findall(r"CLARUS_API [^;{]*?(\w+)(?=\(| \{| :)", headers)) - functions
        listed = output_of("nm", "-DC", "--defined-only", self.library)
        exported = {line.split(" ", 2)[2].split("@")[0] for line in listed.splitlines()}
        exported.discard("CLARUS_0")
        self.assertEqual(functions, {name for name in exported if name.startswith("clarus_")})
        for name in exported - functions:
            plain = re.sub(r"^(typeinfo( name)?|vtable) for ", "", name)
            self.assertRegex(plain, rf"^clarus::({'|'.join(names | {'PipelineOption'})})\b", name)
            self.assertNotIn("::State", plain)

    def test_tool(self):
        tool = os.path.join(self.prefix, "bin", "clarus")
        if not os.path.exists(tool):
            self.skipTest("the tool is not among " + ", ".join(COMPONENTS))
        self.assertIn("enss-s-x2", output_of(tool, "models", env=self.environment))
        if os.path.exists(os.path.join(os.path.dirname(self.library), "clarus", "clarus_render_command.so")):
            self.assertIn("--scene", output_of(tool, "render", "--help", env=self.environment))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
