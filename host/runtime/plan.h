#pragma once

#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "clarus/stream.h"
#include "graph/graph.h"
#include "runtime/bands.h"
#include "runtime/implementation.h"
#include "runtime/inputs.h"
#include "runtime/layout.h"
#include "runtime/memory_plan.h"
#include "runtime/tuner.h"

namespace clarus::runtime {

/// Bytes of the values that are stored of a tensor, without padding.
double tensor_bytes(const TensorLayout& layout);

/// A node that launches a kernel, and the kernel chosen for it.
struct PlannedStage {
    graph::Value value;
    Problem problem;
    Selection selection;
    Lowered lowered;
};

/// Whether it only moves an image into memory where it is wanted, or in bytes: no rule of a placement can name it.
bool only_moves(const PlannedStage& stage);

/// A launch of a stage: for all rows of its result, or for some.
struct StageRows {
    int stage;
    int first = 0, end = 0;  // rows [first, end); all where both are 0
};

/// All that a frame does, before anything is compiled or allocated. `layout.graph` owns what problems point to.
struct Plan {
    LayoutPlan layout;
    MemoryPlan memory;
    IngestProblem ingest;
    std::vector<PlannedStage> stages;
    std::vector<StageRows> launches;  // in this order
    int presenting = -1;              // the stage that writes the caller's output as well; −1: present() does
    size_t weight_bytes = 0;
    std::vector<BandChoice> band_choices;

    std::map<int, Lowered> convolutions() const;  // by index into layout.graph.parameters

    /// By port; null where nothing reads what is imported there.
    std::vector<const TensorLayout*> imports() const, exports() const;
    /// Whether it reads anything of the frame, and whether it makes the output.
    bool ingests() const;
    bool presents() const { return layout.graph.output >= 0; }
};

struct PlanOptions : StreamOptions {
    int band_rows = 0;               // of the output, in a band; 0 chooses (UpscalerOptions::band_rows)
    std::vector<std::string> views;  // intermediates to keep readable
};

/// In which all of these devices can store images as `asked` says: what crosses from one to another has one form.
Precision common_precision(Precision asked, std::span<const DeviceProfile> devices);

/// Fuses, lays out, places and chooses kernels. `select` chooses an operator's kernel. Views that `options` does not
/// name are not kept. `bands`: the band_choices of a plan of the same network at another size, to work as it does.
std::unique_ptr<Plan> make_plan(const graph::Graph& graph, const PlanOptions& options, const DeviceProfile& profile,
                                const std::function<Selection(const Problem&)>& select,
                                const std::vector<BandChoice>& bands = {});

}  // namespace clarus::runtime
