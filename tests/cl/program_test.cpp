#include <doctest/doctest.h>

#include <cstdio>
#include <cstring>
#include <fstream>
#include <functional>
#include <iterator>
#include <numeric>
#include <span>
#include <thread>
#include <vector>

#include "cache_folder.h"
#include "cl/context.h"
#include "cl/disk_cache.h"
#include "cl/kernel_source.h"
#include "cl/platforms.h"
#include "clarus/error.h"
#include "clarus/log.h"
#include "temporary_folder.h"
#include "test_device.h"

using namespace clarus;

namespace {

constexpr const char* source = R"(
kernel void scale(global float* values) { values[get_global_id(0)] *= FACTOR; }
)";

// What a kernel makes of 0, 1, 2, … 7.
std::vector<float> run(ocl::Context& context, const cl::Program& program, const std::string& entry) {
    std::vector<float> values(8);
    std::iota(values.begin(), values.end(), 0.0f);
    const size_t bytes = values.size() * sizeof(float);
    const cl::Buffer buffer(context.context(), CL_MEM_READ_WRITE | CL_MEM_COPY_HOST_PTR, bytes, values.data());
    cl::Kernel kernel(program, entry.c_str());
    kernel.setArg(0, buffer);
    context.queue().enqueueNDRangeKernel(kernel, cl::NullRange, cl::NDRange(values.size()));
    context.queue().enqueueReadBuffer(buffer, CL_TRUE, 0, bytes, values.data());
    return values;
}

std::vector<float> scaled(ocl::Context& context, int factor) {
    const std::string options = "-DFACTOR=" + std::to_string(factor);
    return run(context, context.program_from_source("scale.cl", source, options), "scale");
}

const std::vector<float> threefold = {0, 3, 6, 9, 12, 15, 18, 21};

// How many programs a fresh context compiles to do its work, which is checked and kept.
int compiled_afresh() {
    const Device device = Device::open(test_selector());
    CHECK(scaled(device.context(), 3) == threefold);
    device.context().save_programs();
    return device.context().programs_compiled();
}

std::string contents(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

void overwrite(const std::filesystem::path& path, const std::string& text) {
    std::ofstream(path, std::ios::binary) << text;
}

std::vector<std::filesystem::path> entries(const std::filesystem::path& cache) {
    std::vector<std::filesystem::path> paths;
    for (const auto& entry : std::filesystem::directory_iterator(cache / "programs")) paths.push_back(entry.path());
    return paths;
}

int run_test_case_in_two_processes(const std::string& name) {
    const std::string command =
        std::filesystem::read_symlink("/proc/self/exe").string() + " --test-case='" + name + "' > ";
    const std::string log = (std::filesystem::path(std::getenv("CLARUS_CACHE_DIR")) / "log").string();
    return std::system(
        ("mkdir -p " + cache_directory() + "; " + command + log + "1 & first=$!; " + command + log + "2 && wait $first")
            .c_str());
}

}  // namespace

TEST_SUITE("small") {
    TEST_CASE("a program is compiled once by a context, and not at all by the next") {
        const TemporaryFolder folder;
        const CacheFolder cache(folder.path());
        const Device device = Device::open(test_selector());
        CHECK(scaled(device.context(), 3) == threefold);
        CHECK(scaled(device.context(), 3) == threefold);
        CHECK(device.context().programs_compiled() == 1);
        CHECK(scaled(device.context(), 5)[1] == 5.0f);
        CHECK(device.context().programs_compiled() == 2);
        device.context().save_programs();

        const Device again = Device::open(test_selector());
        CHECK(scaled(again.context(), 3) == threefold);
        CHECK(scaled(again.context(), 5)[7] == 35.0f);
        CHECK(again.context().programs_compiled() == 0);
    }

    TEST_CASE("units of one program may define the same names, and the same file may be there twice") {
        constexpr std::string_view text = R"(
#define DEFINE_TERM(type) \
    INLINE type term_##type(type v) { return v + TERM; }
DEFINE_TERM(float)
typedef struct {
    float factor;
} Factor;

INLINE float times(float v) {
    const Factor f = {FACTOR};
    return f.factor * v;
}

kernel void scale(global float* v) { v[get_global_id(0)] = term_float(times(v[get_global_id(0)])); }
)";
        const std::vector<ocl::ProgramUnit> units{{"one.cl", text, "-DFACTOR=3 -DTERM=0"},
                                                  {"scale.cl", source, "-DFACTOR=3"},
                                                  {"one.cl", text, "-DFACTOR=2 -DTERM=7"}};
        ocl::Context& context = test_device().context();
        const cl::Program program = context.program(units);
        std::vector<float> values;
        for (size_t unit = 0; unit < units.size(); ++unit)
            values.push_back(run(context, program, ocl::name_in_unit("scale", unit))[7]);
        CHECK(values == std::vector<float>{21, 21, 21});
    }

    TEST_CASE("units that a context has in one program are not compiled again in another") {
        const TemporaryFolder folder;
        const CacheFolder cache(folder.path());
        const std::vector<ocl::ProgramUnit> units{
            {"scale.cl", source, "-DFACTOR=2"}, {"scale.cl", source, "-DFACTOR=3"}, {"scale.cl", source, "-DFACTOR=4"}};
        const auto check_sevens = [](ocl::Context& context, std::span<const ocl::ProgramUnit> asked,
                                     const std::vector<float>& expected) {
            std::vector<float> values;
            for (const auto& [program, unit] : context.places(asked))
                values.push_back(run(context, program, ocl::name_in_unit("scale", unit))[7]);
            CHECK(values == expected);
        };
        const std::vector<ocl::ProgramUnit> others{units[2], units[0]};
        const auto compiled = [&](const auto& use) {
            const Device device = Device::open(test_selector());
            use(device.context());
            device.context().save_programs();
            return device.context().programs_compiled();
        };
        CHECK(compiled([&](ocl::Context& context) {
                  check_sevens(context, {units.data(), 2}, {14, 21});
                  check_sevens(context, units, {14, 21, 28});
                  check_sevens(context, others, {28, 14});
              }) == 2);
        // The same in the same order is on disk; and so are all of them, once they have been one program.
        CHECK(compiled([&](ocl::Context& context) {
                  check_sevens(context, {units.data(), 2}, {14, 21});
                  check_sevens(context, units, {14, 21, 28});
              }) == 0);
        CHECK(compiled([&](ocl::Context& context) { check_sevens(context, units, {14, 21, 28}); }) == 1);
        CHECK(compiled([&](ocl::Context& context) {
                  check_sevens(context, {units.data() + 2, 1}, {28});  // which the disk has from the first
                  check_sevens(context, units, {14, 21, 28});
              }) == 0);
    }

    TEST_CASE("a kernel file is found by its name, with what is common before it") {
        ocl::Context& context = test_device().context();
        try {
            context.program("no_such_file", "");
            FAIL("a file that does not exist was built");
        } catch (const Error& error) {
            CHECK(error.kind() == ErrorKind::invalid_argument);
            CHECK(std::string(error.what()).find("no_such_file.cl") != std::string::npos);
        }
        CHECK_NOTHROW(context.program_from_source(
            "common.cl", "kernel void k(global storage* v) { STORE(MAD(LOAD(v, 0), 2.0f, 1.0f), v, 0); }",
            "-DSTORE_HALF"));
    }

    TEST_CASE("a build failure tells the file, the options, the device and what the compiler says") {
        ocl::Context& context = test_device().context();
        for (int attempt = 0; attempt < 2; ++attempt) {
            try {
                context.program_from_source("broken.cl", "kernel void k(global int* v) {\n  v[0] = undeclared_thing; }",
                                            "-DANSWER=42");
                FAIL("it was built");
            } catch (const Error& error) {
                CHECK(error.kind() == ErrorKind::build);
                const std::string message = error.what();
                for (const std::string& part : {std::string("broken.cl"), std::string("-DANSWER=42"),
                                                std::string("undeclared_thing"), context.profile().name})
                    CHECK_MESSAGE(message.find(part) != message.npos, part, " is not in: ", message);
            }
        }
    }

    TEST_CASE("a damaged cache entry is made anew and replaced") {
        const TemporaryFolder folder;
        const CacheFolder cache(folder.path());
        REQUIRE(compiled_afresh() == 1);
        REQUIRE(compiled_afresh() == 0);

        const auto flipped = [](size_t position) {
            return [position](std::string text) {
                text[position < text.size() ? position : text.size() - 1] ^= 1;
                return text;
            };
        };
        const std::function<std::string(std::string)> damages[] = {
            flipped(0),   // magic
            flipped(8),   // key
            flipped(24),  // length
            flipped(31),  // length, by 2^56
            flipped(32),  // hash
            flipped(40),  // body
            flipped(~size_t(0)),
            [](const std::string& text) { return text.substr(0, text.size() / 2); },
            [](const std::string& text) { return text.substr(0, 20); },
            [](const std::string&) { return std::string(); },
            [](const std::string& text) { return text + "more"; },
        };
        for (const auto& damage : damages) {
            for (const auto& entry : entries(folder.path())) overwrite(entry, damage(contents(entry)));
            CHECK(compiled_afresh() == 1);
            CHECK(compiled_afresh() == 0);
        }
        for (const auto& entry : entries(folder.path())) CHECK(entry.extension() != ".partial");
    }

    TEST_CASE("what a cache entry says is believed of its own key, of a sane size, and of the user's own file alone") {
        const TemporaryFolder folder;
        const ocl::DiskCache disk(folder / "programs");
        const ocl::CacheKey one = hash_of("one"), other = hash_of("other");
        disk.store(one, {1, 2, 3});
        CHECK(disk.load(one) == std::vector<unsigned char>{1, 2, 3});
        CHECK((std::filesystem::status(folder / "programs").permissions() & std::filesystem::perms::mask) ==
              std::filesystem::perms::owner_all);

        std::string forged = contents(disk.path(one));
        std::copy(other.begin(), other.end(), forged.begin() + 8);
        overwrite(disk.path(other), forged);
        CHECK_FALSE(disk.load(other));
        overwrite(disk.path(other), contents(disk.path(one)));
        CHECK_FALSE(disk.load(other));

        std::filesystem::permissions(disk.path(one), std::filesystem::perms::others_write,
                                     std::filesystem::perm_options::add);
        CHECK_FALSE(disk.load(one));
        disk.store(one, {4});
        CHECK(disk.load(one) == std::vector<unsigned char>{4});

        const uintmax_t terabyte = uintmax_t{1} << 40;
        std::string header = contents(disk.path(one)).substr(0, 40);
        const uint64_t length = terabyte - header.size();
        std::memcpy(header.data() + 24, &length, sizeof length);
        overwrite(disk.path(one), header);
        std::error_code no_room;
        std::filesystem::resize_file(disk.path(one), terabyte, no_room);
        CHECK_FALSE(disk.load(one));
    }

    TEST_CASE("without a home there is no cache") {
        const TemporaryFolder folder;
        const ocl::DiskCache none{std::filesystem::path()};
        const ocl::CacheKey key = hash_of("key");
        none.store(key, {1});
        CHECK_FALSE(none.load(key));
        CHECK_FALSE(std::filesystem::exists(none.path(key)));
    }

    TEST_CASE("a process among others that share the cache") { CHECK(compiled_afresh() <= 1); }

    TEST_CASE("two processes share the cache") {
        const TemporaryFolder folder;
        const CacheFolder cache(folder.path());
        CHECK(run_test_case_in_two_processes("a process among others that share the cache") == 0);
        CHECK(compiled_afresh() == 0);
    }

    TEST_CASE("a cache folder that cannot be written to costs one warning and nothing else") {
        const TemporaryFolder folder;
        overwrite(folder / "file", "a folder cannot be made under a file");
        const CacheFolder cache(folder / "file" / "cache");
        int warnings = 0;
        set_log_callback([&](LogLevel level, std::string_view) { warnings += level == LogLevel::warning; });
        CHECK(compiled_afresh() == 1);
        CHECK(compiled_afresh() == 1);
        set_log_callback({});
        CHECK(warnings == 1);
    }
}

// Not in the small suite: two compilations at a time in one context are more than Oclgrind takes.
TEST_CASE("threads share a context: each program is compiled once") {
    const TemporaryFolder folder;
    const CacheFolder cache(folder.path());
    const Device device = Device::open(test_selector());
    std::vector<std::thread> threads;
    for (int i = 0; i < 4; ++i)
        threads.emplace_back([&device, i] {
            device.context().program_from_source("scale.cl", source, i % 2 ? "-DFACTOR=1" : "-DFACTOR=2");
        });
    for (std::thread& thread : threads) thread.join();
    CHECK(device.context().programs_compiled() == 2);
}

// Not in the small suite: Rusticl aborts on a binary that it does not know, instead of refusing it.
TEST_CASE("a cached program that the driver refuses is made anew") {
    const TemporaryFolder folder;
    const CacheFolder cache(folder.path());
    REQUIRE(compiled_afresh() == 1);
    const ocl::DiskCache disk(folder / "programs");
    for (const auto& entry : entries(folder.path())) {
        ocl::CacheKey key;
        const std::string text = contents(entry);
        std::copy_n(text.begin() + 8, key.size(), key.begin());
        disk.store(key, {'n', 'o', 't', ' ', 'a', ' ', 'b', 'i', 'n', 'a', 'r', 'y'});
    }
    // A driver that keeps programs itself is not asked to take any.
    CHECK(compiled_afresh() == (ocl::driver_keeps_programs(test_device().context().device()) ? 0 : 1));
    CHECK(compiled_afresh() == 0);
}
