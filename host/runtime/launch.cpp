#include "runtime/launch.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <utility>

#include "cl/error.h"

namespace clarus::runtime {
namespace {

/// struct Sizes of kernels/unit.clh: first_item, then the tensors, then the numbers.
std::vector<std::byte> sizes_of(const KernelCall& call) {
    std::vector<std::byte> sizes(sizeof(cl_int));
    const auto append = [&](const auto& value) {
        const auto* bytes = reinterpret_cast<const std::byte*>(&value);
        sizes.insert(sizes.end(), bytes, bytes + sizeof value);
    };
    for (const NamedTensor& tensor : call.tensors) append(tensor.argument);
    for (const NamedNumber& number : call.numbers) std::visit(append, number.value);
    return sizes;
}

cl::NDRange rounded_up(const std::array<size_t, 2>& global, const std::array<size_t, 2>& local) {
    return {(global[0] + local[0] - 1) / local[0] * local[0], (global[1] + local[1] - 1) / local[1] * local[1]};
}

/// The options that a call's kernel is compiled with. The order of tensors and numbers is that of struct Sizes.
std::string program_options(const KernelCall& call) {
    std::string names;
    for (const NamedTensor& tensor : call.tensors) names += (names.empty() ? " -DTENSORS=" : ",") + tensor.name;
    if (!call.numbers.empty()) names += " -DNUMBERS=";
    for (const NamedNumber& number : call.numbers)
        names += fmt::format("{}({})", std::holds_alternative<float>(number.value) ? "FLOAT" : "INT", number.name);
    return fmt::format("{}{} -DWG_X={} -DWG_Y={}", call.options, names, call.local[0], call.local[1]);
}

}  // namespace

std::string program_key(const KernelCall& call) {
    return fmt::format("{} {}\n{}", call.file, program_options(call), call.source);
}

Kernels::Kernels(ocl::Context& context, const std::vector<const KernelCall*>& calls) { add(context, calls); }

void Kernels::add(ocl::Context& context, const std::vector<const KernelCall*>& calls) {
    std::vector<std::string> keys, files, options;
    std::vector<const KernelCall*> different;
    for (const KernelCall* call : calls) {
        std::string key = program_key(*call);
        if (places_.contains(key) || std::find(keys.begin(), keys.end(), key) != keys.end()) continue;
        keys.push_back(std::move(key));
        files.push_back(call->source.empty() ? call->file + ".cl" : call->file);
        options.push_back(program_options(*call));
        different.push_back(call);
    }
    std::vector<ocl::ProgramUnit> units;
    for (size_t i = 0; i < different.size(); ++i) {
        const std::string& source = different[i]->source;
        units.push_back({files[i], source.empty() ? ocl::kernel_file(files[i]) : source, options[i]});
    }
    const auto compile_each = [&] {
        for (size_t i = 0; i < units.size(); ++i) places_[keys[i]] = context.places({&units[i], 1}).front();
    };
    if (units.empty()) return;
    // Oclgrind takes the local memory of all kernels of a program to be each one's.
    if (units.size() <= 1 || context.profile().simulator) {
        compile_each();
        return;
    }
    try {
        const std::vector<ocl::UnitPlace> places = context.places(units);
        for (size_t i = 0; i < units.size(); ++i) places_[keys[i]] = places[i];
    } catch (const Error& error) {
        if (error.kind() != ErrorKind::build) throw;
        compile_each();  // says which one it is; or, where a compiler takes each but not all at once, that will do
    }
}

cl::Kernel Kernels::create(const KernelCall& call, const std::string& entry) const {
    const ocl::UnitPlace& place = places_.at(program_key(call));
    const std::string name = ocl::name_in_unit(entry, place.unit);
    return ocl::checked("create kernel " + entry, [&] { return cl::Kernel(place.program, name.c_str()); });
}

Launch::Launch(const Kernels& kernels, KernelCall call)
    : call_(std::move(call)),
      kernel_(kernels.create(call_, call_.entry)),
      doing_("run kernel " + call_.entry),
      sizes_(sizes_of(call_)),
      first_argument_(call_.tensors.empty() ? 0 : 1) {
    set_first_item(0);
}

void Launch::set_first_item(int item) {
    if (call_.tensors.empty()) return;
    const auto first_item = static_cast<cl_int>(item);
    std::memcpy(sizes_.data(), &first_item, sizeof first_item);
    ocl::checked(doing_, [&] { kernel_.setArg(0, sizes_.size(), sizes_.data()); });
}

void Launch::bind(const Bindings& bindings) {
    ocl::checked(doing_, [&] {
        cl_uint position = first_argument_;
        for (const Argument& argument : call_.arguments) {
            switch (argument.kind) {
                case ArgumentKind::input:
                    kernel_.setArg(position, bindings.inputs[argument.index]);
                    break;
                case ArgumentKind::output:
                    kernel_.setArg(position, bindings.output);
                    break;
                case ArgumentKind::packed_weights:
                    kernel_.setArg(position, bindings.packed_weights);
                    break;
                case ArgumentKind::packed_offset:
                    kernel_.setArg(position, bindings.packed_offset);
                    break;
                case ArgumentKind::frame:
                    kernel_.setArg(position, bindings.frame);
                    break;
                case ArgumentKind::resource:
                    kernel_.setArg(position, bindings.resources[argument.index]);
                    break;
                case ArgumentKind::resource_offset:
                    kernel_.setArg(position, bindings.resource_offsets[argument.index]);
                    break;
                case ArgumentKind::target:
                    kernel_.setArg(position, bindings.target);
                    break;
                case ArgumentKind::target_offset:
                    kernel_.setArg(position, bindings.target_offset);
                    break;
                case ArgumentKind::counter:
                    kernel_.setArg(position, bindings.counter);
                    break;
                case ArgumentKind::exposure_image:
                    kernel_.setArg(position, bindings.exposure_image);
                    break;
                case ArgumentKind::exposure_offset:
                    kernel_.setArg(position, bindings.exposure_offset);
                    break;
                case ArgumentKind::exposure:
                    kernel_.setArg(position, bindings.exposure);
                    break;
            }
            ++position;
        }
    });
}

void Launch::enqueue(const cl::CommandQueue& queue, cl::Event* event) const {
    ocl::checked(doing_, [&] {
        queue.enqueueNDRangeKernel(kernel_, cl::NullRange, rounded_up(call_.global, call_.local),
                                   cl::NDRange(call_.local[0], call_.local[1]), nullptr, event);
    });
}

void Launch::enqueue_rows(const cl::CommandQueue& queue, int first, int end, cl::Event* event) {
    // Not by a global offset, for which PoCL compiles a kernel once more.
    std::array<size_t, 2> global = call_.global;
    global[call_.row_axis] = (end - first + call_.rows_an_item - 1) / call_.rows_an_item;
    set_first_item(first / call_.rows_an_item);
    ocl::checked(doing_, [&] {
        queue.enqueueNDRangeKernel(kernel_, cl::NullRange, rounded_up(global, call_.local),
                                   cl::NDRange(call_.local[0], call_.local[1]), nullptr, event);
    });
    set_first_item(0);
}

PackLaunch::PackLaunch(const Kernels& kernels, const Packing& packing)
    : packing_(packing),
      kernel_(kernels.create(packing_.call, packing_.call.entry)),
      doing_("run kernel " + packing_.call.entry) {}

void PackLaunch::enqueue(const cl::CommandQueue& queue, const Source& source, const cl::Buffer& packed, int set) {
    ocl::checked(doing_, [&] {
        kernel_.setArg(0, source.weights);
        kernel_.setArg(1, source.biases);
        kernel_.setArg(2, packed);
        kernel_.setArg(3, static_cast<cl_uint>(set * packing_.floats));
        kernel_.setArg(4, static_cast<cl_uint>(source.weights_offset));
        kernel_.setArg(5, static_cast<cl_uint>(source.biases_offset));
        kernel_.setArg(6, packing_.shape);
        queue.enqueueNDRangeKernel(kernel_, cl::NullRange,
                                   cl::NDRange(packing_.call.global[0], packing_.call.global[1]), cl::NDRange(1, 1));
    });
}

}  // namespace clarus::runtime
