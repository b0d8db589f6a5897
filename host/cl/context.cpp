#include "cl/context.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <numeric>
#include <set>

#include "base/log.h"
#include "cl/build.h"
#include "cl/error.h"
#include "cl/platforms.h"
#include "cl/profile.h"

namespace clarus::ocl {
namespace {

bool has_property(const cl::CommandQueue& queue, cl_command_queue_properties property) {
    return (queue.getInfo<CL_QUEUE_PROPERTIES>() & property) != 0;
}

// Empty where the driver has none to give. The binaries come in the order of the program's devices, where some drivers
// name a sub-device's parent: with one binary there is no doubt.
std::vector<unsigned char> binary_for(const cl::Program& program, const cl::Device& device) {
    const auto binaries = program.getInfo<CL_PROGRAM_BINARIES>();
    if (binaries.size() == 1) return binaries.front();
    const std::vector<cl::Device> devices = program.getInfo<CL_PROGRAM_DEVICES>();
    for (size_t i = 0; i < std::min(binaries.size(), devices.size()); ++i)
        if (devices[i]() == device()) return binaries[i];
    return {};
}

/// "warp.cl with the options '…'", or of several the files.
std::string describe(std::span<const ProgramUnit> units) {
    if (units.size() == 1) return fmt::format("{} with the options '{}'", units[0].name, units[0].options);
    std::set<std::string_view> names;
    for (const ProgramUnit& unit : units) names.insert(unit.name);
    return fmt::format("a program of {}", fmt::join(names, ", "));
}

}  // namespace

Context::Context(cl::Context context, cl::Device device, DeviceProfile profile)
    : profile_(std::move(profile)),
      device_(std::move(device)),
      context_(std::move(context)),
      disk_cache_(programs_directory()),
      identity_(device_identity(device_)),
      driver_keeps_programs_(driver_keeps_programs(device_)) {
    checked(fmt::format("make a queue on {}", profile_.name),
            [&] { queue_ = cl::CommandQueue(context_, device_, CL_QUEUE_PROFILING_ENABLE); });
}

Context::Context(cl::Context context, cl::Device device, cl::CommandQueue queue, DeviceProfile profile)
    : profile_(std::move(profile)),
      device_(std::move(device)),
      context_(std::move(context)),
      queue_(std::move(queue)),
      disk_cache_(programs_directory()),
      identity_(device_identity(device_)),
      driver_keeps_programs_(driver_keeps_programs(device_)) {
    checked("take over the caller's queue", [&] {
        queue_is_callers_ = !has_property(queue_, CL_QUEUE_OUT_OF_ORDER_EXEC_MODE_ENABLE);
        if (!queue_is_callers_) queue_ = cl::CommandQueue(context_, device_, CL_QUEUE_PROFILING_ENABLE);
        queue_has_profiling_ = has_property(queue_, CL_QUEUE_PROFILING_ENABLE);
    });
}

std::shared_ptr<Context> Context::with_another_queue() const {
    return checked(fmt::format("make another queue on {}", profile_.name), [&] {
        const auto other = std::make_shared<Context>(context_, device_, profile_);
        other->programs_ = programs_;
        return other;
    });
}

cl::Program Context::program(std::string_view file, std::string_view options) {
    const std::string name = fmt::format("{}.cl", file);
    return program_from_source(name, kernel_file(name), options);
}

cl::Program Context::program_from_source(std::string_view name, std::string_view source, std::string_view options) {
    const ProgramUnit unit{name, source, options};
    return program({&unit, 1});
}

std::vector<UnitPlace> Context::places(std::span<const ProgramUnit> units) {
    std::vector<UnitPlace> places(units.size());
    std::vector<ProgramUnit> missing;
    std::vector<size_t> of_missing;
    const auto key_of = [](const ProgramUnit& unit) { return hash_of_parts({unit.name, unit.source, unit.options}); };
    {
        const std::lock_guard lock(programs_->mutex);
        for (size_t i = 0; i < units.size(); ++i) {
            if (const auto known = programs_->units.find(key_of(units[i])); known != programs_->units.end()) {
                places[i] = known->second;
            } else {
                missing.push_back(units[i]);
                of_missing.push_back(i);
            }
        }
    }
    if (missing.empty()) return places;
    const bool on_disk = missing.size() < units.size() &&
                         std::filesystem::exists(disk_cache_.path(hash_of_parts({program_text(units), identity_})));
    if (on_disk) {
        missing.assign(units.begin(), units.end());
        of_missing.resize(units.size());
        std::iota(of_missing.begin(), of_missing.end(), size_t{0});
    }
    const cl::Program program_of_missing = program(missing);
    const std::lock_guard lock(programs_->mutex);
    for (size_t i = 0; i < missing.size(); ++i)
        programs_->units[key_of(missing[i])] = places[of_missing[i]] = {program_of_missing, i};
    return places;
}

cl::Program Context::program(std::span<const ProgramUnit> units) {
    const std::string text = program_text(units);
    const CacheKey key = hash_of_parts({text, identity_});

    std::promise<cl::Program> promise;
    std::shared_future<cl::Program> program;
    bool is_first = false;
    {
        const std::lock_guard lock(programs_->mutex);
        const auto [entry, inserted] = programs_->programs.try_emplace(key);
        if (inserted) entry->second = promise.get_future().share();
        program = entry->second;
        is_first = inserted;
    }
    if (is_first) {
        try {
            promise.set_value(load_or_compile(units, text, key));
        } catch (...) {
            promise.set_exception(std::current_exception());
            const std::lock_guard lock(programs_->mutex);
            programs_->programs.erase(key);  // the next to ask tries again
        }
    }
    return program.get();
}

cl::Program Context::load_or_compile(std::span<const ProgramUnit> units, const std::string& text, const CacheKey& key) {
    const auto binary = disk_cache_.load(key);
    if (binary && driver_keeps_programs_) return build(units, text);
    if (binary) {
        try {
            cl::Program program(context_, {device_}, {*binary});
            build_program(program, device_, nullptr);
            return program;
        } catch (const cl::Error& error) {
            log(LogLevel::debug, "{}: the driver refuses the cached program ({}); it is compiled anew", describe(units),
                status_name(error.err()));
        }
    }
    const auto start = std::chrono::steady_clock::now();
    cl::Program program = build(units, text);
    log(LogLevel::debug, "compiled {} in {:.0f} ms", describe(units),
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
    ++programs_->compiled;
    const std::lock_guard lock(programs_->mutex);
    programs_->unsaved.emplace(key, program);
    return program;
}

cl::Program Context::build(std::span<const ProgramUnit> units, const std::string& text) {
    const cl::Program program =
        checked(fmt::format("make a program of {}", describe(units)), [&] { return cl::Program(context_, text); });
    try {
        build_program(program, device_);
    } catch (const cl::Error& error) {
        if (error.err() != CL_BUILD_PROGRAM_FAILURE)
            fail_with_status(fmt::format("compile {}", describe(units)), error.err());
        const auto build_log =
            checked("read the compiler's log", [&] { return program.getBuildInfo<CL_PROGRAM_BUILD_LOG>(device_); });
        fail(ErrorKind::build, "{} does not compile on {} (driver {}): {}. The compiler says:\n{}", describe(units),
             profile_.name, profile_.driver_version, status_name(error.err()), build_log);
    }
    return program;
}

void Context::save_programs() {
    std::map<CacheKey, cl::Program> unsaved;
    {
        const std::lock_guard lock(programs_->mutex);
        unsaved.swap(programs_->unsaved);
    }
    for (const auto& [key, program] : unsaved) {
        if (driver_keeps_programs_) {
            disk_cache_.store(key, {});
            continue;
        }
        try {
            if (const auto binary = binary_for(program, device_); !binary.empty()) disk_cache_.store(key, binary);
        } catch (const cl::Error& error) {
            log(LogLevel::debug, "{} gives no compiled program ({}); it will be compiled again", profile_.name,
                status_name(error.err()));
        }
    }
}

}  // namespace clarus::ocl
