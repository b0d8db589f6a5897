#include "runtime/program.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include "base/error.h"
#include "cl/error.h"

namespace clarus::runtime {
namespace {

cl::Buffer zeroed(ocl::Context& context, size_t bytes) {
    const cl::Buffer buffer(context.context(), CL_MEM_READ_WRITE, bytes);
    context.queue().enqueueFillBuffer(buffer, cl_uint(0), 0, bytes / sizeof(cl_uint) * sizeof(cl_uint));
    context.queue().finish();
    return buffer;
}

size_t bytes_of_export(const PartPlan& part, int port) {
    const Plan& plan = *part.plan;
    return plan.memory.places[plan.exports()[port]->memory].bytes;
}

/// Less than 0 where the command failed.
cl_int status(const cl::Event& event) { return event.getInfo<CL_EVENT_COMMAND_EXECUTION_STATUS>(); }

}  // namespace

std::optional<FrameFailure> failure_of(const FrameResult& frame) {
    return ocl::checked("ask how a frame ended", [&]() -> std::optional<FrameFailure> {
        for (size_t part = 0; part < frame.parts.size(); ++part)
            if (const cl_int ended = status(frame.parts[part]->done); ended < 0)
                return FrameFailure{static_cast<int>(part), ended};
        if (!frame.done()) return std::nullopt;
        if (const cl_int ended = status(frame.done); ended < 0) return FrameFailure{frame.presenting, ended};
        return std::nullopt;
    });
}

Program::Program(const ocl::Context& callers, std::span<const PartPlan> parts, std::span<const graph::Link> links,
                 std::span<const std::unique_ptr<Plan>> others, const StreamOptions& options,
                 const std::function<void(double)>& progress)
    : callers_(callers.context()), profile_(options.profile), imports_(parts.size()), exports_(parts.size()) {
    for (const PartPlan& part : parts) {
        contexts_.push_back(part.context);
        devices_.push_back(part.device);
        uses_frame_.push_back(part.plan->ingests() || part.plan->presents());
        if (part.plan->presents()) presenting_ = static_cast<int>(contexts_.size()) - 1;
    }
    ocl::checked("make what devices hand over", [&] {
        for (const graph::Link& link : links) {
            std::vector<Import>& imports = imports_[link.to];
            imports.resize(std::max<size_t>(imports.size(), link.to_port + 1));
            imports[link.to_port] = {handover_to(parts, link), link.frames_ago};
        }
    });
    order_commands(parts);
    for (size_t part = 0; part < parts.size(); ++part)
        executors_.push_back(std::make_unique<Executor>(*parts[part].context, *parts[part].plan, others, options,
                                                        handed_in(static_cast<int>(part)), [&](double done) {
                                                            if (progress)
                                                                progress((static_cast<double>(part) + done) /
                                                                         static_cast<double>(parts.size()));
                                                        }));
}

Program::~Program() { finish(); }

void Program::finish() {
    for (const ocl::Context* context : contexts_) clFinish(context->queue()());
    for (const Handover& handover : handovers_)
        if (handover.transfer) handover.transfer->finish();
}

/// The handover that a link reads, made where it is not there.
int Program::handover_to(std::span<const PartPlan> parts, const graph::Link& link) {
    const auto add = [&](int reader) {
        const cl::Context& context = parts[reader].context->context();
        for (size_t index = 0; index < handovers_.size(); ++index)
            if (handovers_[index].from == link.from && handovers_[index].port == link.from_port &&
                handovers_[index].context() == context())
                return static_cast<int>(index);
        const PartPlan& from = parts[link.from];
        const TensorLayout& layout = *from.plan->exports()[link.from_port];
        const size_t bytes = from.plan->memory.places[layout.memory].bytes;
        Handover handover{link.from, link.from_port, layout, context, bytes, {}, nullptr};
        for (cl::Buffer& buffer : handover.buffers) buffer = zeroed(*parts[reader].context, handover.bytes);
        if (!from.context->shares_memory_with(*parts[reader].context)) {
            const graph::Graph& graph = from.plan->layout.graph;
            handover.transfer =
                std::make_unique<Transfer>(*from.context, *parts[reader].context, handover.bytes,
                                           "transfer: " + graph.nodes[graph.exports[link.from_port]].name, profile_);
        }
        handovers_.push_back(std::move(handover));
        return static_cast<int>(handovers_.size()) - 1;
    };
    std::vector<int>& exports = exports_[link.from];
    exports.resize(std::max<size_t>(exports.size(), link.from_port + 1), -1);
    exports[link.from_port] = add(link.from);
    return add(link.to);
}

/// Each part runs, then what it exports is transferred. A buffer is written again two frames later, when those that
/// read it have done so.
void Program::order_commands(std::span<const PartPlan> parts) {
    constexpr int kBuffers = 2;
    std::vector<int> runs(parts.size()), transfers(handovers_.size(), -1);  // the commands
    for (size_t part = 0; part < parts.size(); ++part) {
        runs[part] = static_cast<int>(commands_.size());
        commands_.push_back({static_cast<int>(part), -1, {}, {}});
        for (size_t index = 0; index < handovers_.size(); ++index) {
            if (handovers_[index].from != static_cast<int>(part) || !handovers_[index].transfer) continue;
            transfers[index] = static_cast<int>(commands_.size());
            commands_.push_back({-1, static_cast<int>(index), {{runs[part], 0}}, {}});
        }
    }
    for (size_t reader = 0; reader < parts.size(); ++reader)
        for (const auto& [index, frames_ago] : imports_[reader]) {
            const Handover& handover = handovers_[index];
            const Wait read{runs[reader], kBuffers - frames_ago};
            if (handover.transfer) {
                commands_[runs[reader]].waits.push_back({transfers[index], frames_ago});
                commands_[transfers[index]].destination_waits.push_back(read);
            } else if (handover.from != static_cast<int>(reader)) {
                commands_[runs[reader]].waits.push_back({runs[handover.from], frames_ago});
                commands_[runs[handover.from]].waits.push_back(read);
            }
        }
    for (size_t index = 0; index < handovers_.size(); ++index)
        if (transfers[index] >= 0)
            commands_[runs[handovers_[index].from]].waits.push_back({transfers[index], kBuffers, true});
}

std::vector<cl::Event> Program::events(const std::vector<Wait>& waits) const {
    std::vector<cl::Event> events;
    for (const auto& [command, frames_ago, at_source] : waits) {
        if (static_cast<size_t>(frames_ago) >= frames_) continue;  // there was no such frame
        const std::vector<Transfer::Ends>& ends = ends_[(frames_ - frames_ago) % ends_.size()];
        if (ends.empty()) continue;  // it failed
        events.push_back(at_source ? ends[command].source_free : ends[command].destination_ready);
    }
    return events;
}

HandedIn Program::handed_in(int part) const {
    const auto buffer = [&](int handover, size_t frame) { return handovers_[handover].buffers[frame % 2]; };
    HandedIn result;
    for (const auto& [handover, frames_ago] : imports_[part])
        result.imports.push_back(buffer(handover, frames_ - frames_ago));
    for (const int handover : exports_[part]) result.exports.push_back(buffer(handover, frames_));
    return result;
}

std::vector<KeptMemory> Program::kept() const {
    std::vector<KeptMemory> kept;
    std::set<int> handed_over;  // to the next frame
    for (size_t part = 0; part < executors_.size(); ++part) {
        for (KeptMemory& state : executors_[part]->kept()) {
            state.name = fmt::format("part {}, {}", part, state.name);
            kept.push_back(std::move(state));
        }
        for (const auto& [index, frames_ago] : imports_[part]) {
            if (frames_ago == 0 || !handed_over.insert(index).second) continue;
            const Handover& handover = handovers_[index];
            kept.push_back({fmt::format("handover {}, of part {}", index, handover.from), handover.layout,
                            contexts_[part], handover.buffers[frames_ % 2], handover.bytes});
        }
    }
    return kept;
}

std::vector<KeptValue> Program::read_kept() {
    finish();
    return ocl::checked("read the history", [&] {
        std::vector<KeptValue> values;
        for (const KeptMemory& memory : kept()) {
            std::vector<std::byte> bytes(memory.bytes);
            memory.context->queue().enqueueReadBuffer(memory.buffer, CL_TRUE, 0, bytes.size(), bytes.data());
            values.push_back({memory.name, text_of(memory.layout), memory.layout.storage, std::move(bytes)});
        }
        return values;
    });
}

void Program::write_kept(std::span<const KeptValue> values) {
    const std::vector<KeptMemory> memories = kept();
    if (values.size() != memories.size())
        fail(ErrorKind::invalid_argument, "history: it has {} values, and {} are kept here", values.size(),
             memories.size());
    std::map<std::string, const KeptValue*> by_name;
    for (const KeptValue& value : values) by_name[value.name] = &value;
    for (const KeptMemory& memory : memories) {
        const auto found = by_name.find(memory.name);
        if (found == by_name.end()) fail(ErrorKind::invalid_argument, "history: it lacks \"{}\"", memory.name);
        const KeptValue& value = *found->second;
        const std::string here = text_of(memory.layout);
        if (value.layout != here || value.bytes.size() != memory.bytes)
            fail(ErrorKind::invalid_argument, "history: \"{}\" is {} in {} bytes, and {} in {} bytes here", value.name,
                 value.layout, value.bytes.size(), here, memory.bytes);
    }
    finish();
    ocl::checked("write the history", [&] {
        for (const KeptMemory& memory : memories)
            memory.context->queue().enqueueWriteBuffer(memory.buffer, CL_TRUE, 0, memory.bytes,
                                                       by_name.at(memory.name)->bytes.data());
    });
    for (const auto& executor : executors_) executor->states_are_written();
}

std::shared_ptr<FrameResult> Program::submit(const FrameDescription& frame, const FrameConstants& constants) {
    check_callers_events(frame);
    ++frames_;
    std::weak_ptr<const FrameResult>& last = last_results_[frames_ % last_results_.size()];
    if (executors_.size() == 1 && contexts_.front()->context()() == callers_()) {
        const std::shared_ptr<FrameResult> result = submit_to(0, frame, constants, frame.wait_for);
        last = result;
        return result;
    }
    const auto free = ocl::checked("submit a frame", [&] {
        return std::find_if(results_.begin(), results_.end(), [](const auto& result) {
            return result.use_count() == 1 && status(result->done) <= CL_COMPLETE;
        });
    });
    const std::shared_ptr<FrameResult> result =
        free != results_.end() ? *free : results_.emplace_back(std::make_shared<FrameResult>());
    try {
        enqueue_frame(frame, constants, *result);
    } catch (...) {
        finish();
        for (std::vector<Transfer::Ends>& ends : ends_) ends.clear();
        results_.erase(std::find(results_.begin(), results_.end(), result));
        throw;
    }
    last = result;
    return result;
}

std::shared_ptr<FrameResult> Program::submit_to(int part, const FrameDescription& frame,
                                                const FrameConstants& constants, std::span<const cl_event> wait_for) {
    try {
        const std::shared_ptr<FrameResult> result = executors_[part]->submit(frame, constants, wait_for);
        result->device = devices_[part];
        return result;
    } catch (const Error& error) {
        failed_part_ = part;
        fail(error.kind(), "{}: {}", devices_[part], error.what());
    }
}

std::optional<int> Program::failed_part() const {
    if (failed_part_) return failed_part_;
    for (size_t ago = 0; ago < last_results_.size(); ++ago) {  // from the oldest on
        const size_t index = (frames_ + 1 + ago) % last_results_.size();
        if (const auto result = last_results_[index].lock())
            if (const auto failure = failure_of(*result)) return failure->part;
    }
    return std::nullopt;
}

void Program::enqueue_frame(const FrameDescription& frame, const FrameConstants& constants, FrameResult& result) {
    std::vector<Transfer::Ends>& ends = ends_[frames_ % ends_.size()];
    ends.assign(commands_.size(), {});
    result.parts.clear();
    result.presenting = presenting_;
    for (const Handover& handover : handovers_)
        if (handover.transfer) handover.transfer->profiler().begin_frame();
    for (size_t index = 0; index < commands_.size(); ++index) {
        const Command& command = commands_[index];
        if (command.part < 0) {
            ends[index] = transfer(command);
            continue;
        }
        Executor& executor = *executors_[command.part];
        executor.hand_in(handed_in(command.part));
        std::vector<cl::Event> waits = events(command.waits);
        if (uses_frame_[command.part]) add_callers_events(frame, *contexts_[command.part], waits);
        std::vector<cl_event> handles;
        for (const cl::Event& event : waits) handles.push_back(event());
        result.parts.push_back(submit_to(command.part, frame, constants, handles));
        ends[index] = {result.parts.back()->done, result.parts.back()->done};
    }
    ocl::checked("submit a frame", [&] {
        const ocl::Context& context = *contexts_[presenting_];
        std::vector<cl::Event> visible;  // of what reads the frame's inputs or writes its output
        for (size_t part = 0; part < executors_.size(); ++part)
            if (uses_frame_[part]) visible.push_back(event_in(context.context(), result.parts[part]->done));
        cl::Event done;
        context.queue().enqueueMarkerWithWaitList(&visible, &done);
        context.queue().flush();
        result.done = event_in(callers_, done);
    });
}

void Program::add_callers_events(const FrameDescription& frame, const ocl::Context& context,
                                 std::vector<cl::Event>& waits) const {
    ocl::checked("take the events that a frame waits for", [&] {
        for (const cl_event handle : frame.wait_for)
            waits.push_back(event_in(context.context(), cl::Event(handle, true)));
    });
}

void Program::check_callers_events(const FrameDescription& frame) const {
    ocl::checked("take the events that a frame waits for", [&] {
        for (const cl_event handle : frame.wait_for)
            if (cl::Event(handle, true).getInfo<CL_EVENT_CONTEXT>()() != callers_())
                throw cl::Error(CL_INVALID_CONTEXT, "an event of another context than the first device's");
    });
}

Transfer::Ends Program::transfer(const Command& command) {
    const Handover& to = handovers_[command.handover];
    const Handover& from = handovers_[exports_[to.from][to.port]];
    return ocl::checked("hand over to another device", [&] {
        return to.transfer->enqueue(from.buffers[frames_ % 2], to.buffers[frames_ % 2], events(command.waits),
                                    events(command.destination_waits));
    });
}

double Program::largest_jitter_distance() const {
    double largest = 0;
    for (const auto& executor : executors_) largest = std::max(largest, executor->largest_jitter_distance());
    return largest;
}

std::vector<StageProfile> Program::take_transfers_profile() {
    std::vector<StageProfile> profiles;
    for (const Handover& handover : handovers_)
        if (handover.transfer)
            for (StageProfile& stage : handover.transfer->profiler().take()) profiles.push_back(std::move(stage));
    return profiles;
}

size_t Program::link_bytes(std::span<const PartPlan> parts, std::span<const graph::Link> links) {
    std::set<std::tuple<int, int, cl_context>> handovers;
    for (const graph::Link& link : links)
        for (const int reader : {link.from, link.to})
            handovers.insert({link.from, link.from_port, parts[reader].context->context()()});
    size_t bytes = 0;
    for (const auto& [from, port, context] : handovers) bytes += 2 * bytes_of_export(parts[from], port);
    return bytes;
}

}  // namespace clarus::runtime
