#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "graph/partition.h"
#include "runtime/executor.h"
#include "runtime/transfer.h"

namespace clarus::runtime {

/// A part of a network: what it does, and the device that does it, by a queue of the part's own.
struct PartPlan {
    ocl::Context* context;
    const Plan* plan;
    std::string device;  // as errors name it
};

/// How a frame ended that did not end well.
struct FrameFailure {
    int part;       // that failed first; 0 where the frame has no parts
    cl_int status;  // of its last command
};

/// None where the frame did not fail, or is still on its way. Errors: device.
std::optional<FrameFailure> failure_of(const FrameResult& frame);

/// What a program keeps from one frame to the next, with where it was as text: `layout` is how its elements lie.
struct KeptValue {
    std::string name, layout;
    Storage storage;
    std::vector<std::byte> bytes;
};

/// The commands of a frame, on one device or several: parts of the network that run, and transfers between devices that
/// do not see the same memory. Each waits for what it needs, of this frame and of those before, and for nothing else:
/// while one device works on a frame, another works on the next.
class Program {
  public:
    /// Compiles, allocates and uploads. Contexts, plans and `options` outlive the program. `callers`: the context that
    /// events of callers are of, and those that they get. `others`: Executor's, where there is one part. `progress` is
    /// called with 0…1. Errors: build, out_of_memory, device.
    Program(const ocl::Context& callers, std::span<const PartPlan> parts, std::span<const graph::Link> links,
            std::span<const std::unique_ptr<Plan>> others, const StreamOptions& options,
            const std::function<void(double)>& progress);
    /// Waits for frames on their way.
    ~Program();
    Program(const Program&) = delete;
    Program& operator=(const Program&) = delete;

    /// Executor::submit.
    std::shared_ptr<FrameResult> submit(const FrameDescription& frame, const FrameConstants& constants);

    bool has_run() const { return frames_ > 0; }

    /// What the frames leave for the next, of every part and from part to part, byte by byte. Waits for the frames on
    /// their way. Errors: device.
    std::vector<KeptValue> read_kept();
    /// Puts it where the next frame looks for it. Waits, as read_kept does. Errors: invalid_argument, naming what is
    /// not of this program's form; device.
    void write_kept(std::span<const KeptValue> values);

    /// The part whose device failed, in submit or since then.
    std::optional<int> failed_part() const;
    Executor& executor(int part) { return *executors_[part]; }
    const Executor& executor(int part) const { return *executors_[part]; }
    double largest_jitter_distance() const;
    /// Profiler::take of a part.
    std::vector<StageProfile> take_profile(int part) { return executors_[part]->profiler().take(); }
    std::vector<StageProfile> take_transfers_profile();

    /// Device memory of what parts hand over, in bytes, each of it twice: a frame's while the frame before's is read.
    static size_t link_bytes(std::span<const PartPlan> parts, std::span<const graph::Link> links);

  private:
    /// Two frames' values of an export, in the context of a part or of those that read it.
    struct Handover {
        int from, port;
        TensorLayout layout;
        cl::Context context;
        size_t bytes;
        std::array<cl::Buffer, 2> buffers;
        std::unique_ptr<Transfer> transfer;  // null in the exporting part's own context
    };
    struct Import {
        int handover;
        int frames_ago;
    };
    /// A command of this frame or of one before, which another waits for.
    struct Wait {
        int command;
        int frames_ago;
        bool at_source = false;  // of a transfer: its source's end
    };
    struct Command {
        int part = -1, handover = -1;         // runs the part, or transfers to that handover
        std::vector<Wait> waits;              // of a transfer, at its source,
        std::vector<Wait> destination_waits;  // and at its destination
    };

    int handover_to(std::span<const PartPlan> parts, const graph::Link& link);
    void order_commands(std::span<const PartPlan> parts);
    std::vector<cl::Event> events(const std::vector<Wait>& waits) const;
    HandedIn handed_in(int part) const;
    std::shared_ptr<FrameResult> submit_to(int part, const FrameDescription& frame, const FrameConstants& constants,
                                           std::span<const cl_event> wait_for);
    void enqueue_frame(const FrameDescription& frame, const FrameConstants& constants, FrameResult& result);
    void check_callers_events(const FrameDescription& frame) const;
    void add_callers_events(const FrameDescription& frame, const ocl::Context& context,
                            std::vector<cl::Event>& waits) const;
    Transfer::Ends transfer(const Command& command);
    void finish();
    std::vector<KeptMemory> kept() const;

    cl::Context callers_;
    const bool profile_;
    std::vector<ocl::Context*> contexts_;  // of the parts
    std::vector<std::string> devices_;     // likewise, as errors name them
    std::vector<bool> uses_frame_;         // whether a part reads the frame's inputs or writes its output
    int presenting_ = 0;                   // the part that writes the output
    std::vector<Handover> handovers_;
    std::vector<std::vector<Import>> imports_;  // by part and port
    std::vector<std::vector<int>> exports_;     // handovers in the part's own context, by part and port
    std::vector<Command> commands_;
    std::vector<std::unique_ptr<Executor>> executors_;  // one a part
    std::array<std::vector<Transfer::Ends>, 3> ends_;   // of the commands of the last frames, by number modulo 3
    size_t frames_ = 0;
    std::vector<std::shared_ptr<FrameResult>> results_;
    std::array<std::weak_ptr<const FrameResult>, 3> last_results_;
    std::optional<int> failed_part_;  // in submit
};

}  // namespace clarus::runtime
