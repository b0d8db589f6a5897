#include "cli/overwriting.h"

#include "base/error.h"
#include "cli/run_state.h"
#include "io/safetensors.h"

namespace clarus::cli {

void refuse_overwriting_inputs(const std::filesystem::path& sequence_path, const io::Sequence& sequence,
                               const Model& model, const FrameOutput& output, const std::filesystem::path& report,
                               const std::filesystem::path& trace) {
    const bool writes_folder = !output.writer && output.picture.empty();
    const std::set<std::filesystem::path> inputs = folders_of(images_of(sequence));
    if (writes_folder && inputs.contains(resolved(output.folder)))
        fail(ErrorKind::invalid_argument, "--output {} holds images of the sequence; name another folder",
             output.folder.string());
    if (writes_folder && resolved(output.folder) == resolved(folder_of(sequence.folder / "")))
        fail(ErrorKind::invalid_argument, "--output {} is the sequence's own folder; name another",
             output.folder.string());

    for (const std::string& view : output.views)
        if (const auto folder = output.view_file(view, "0").parent_path(); inputs.contains(resolved(folder)))
            fail(ErrorKind::invalid_argument, "--view {}: {} holds images of the sequence; name another --output", view,
                 folder.string());

    TakenFiles taken;
    // One image is no folder's: others may lie beside it.
    if (sequence.frames.size() == 1 && sequence.frames.front().color == sequence_path)
        taken.add(sequence_path, "the sequence");
    else
        taken.add(sequence_path, sequence);
    if (model.tensors()) taken.add(model.tensors()->path(), "the model");
    if (writes_folder)
        taken.add(run_state_file(output.folder), "the run's state");
    else
        taken.take("--output", output.writer ? output.video : output.picture);
    for (const io::FrameFiles& frame : sequence.frames) {
        if (!writes_folder) break;
        taken.add(output.file(frame.name), "an image of --output");
        if (output.interpolated) taken.add(output.file_before(frame.name), "an image of --output");
        for (const std::string& view : output.views)
            taken.add(output.view_file(view, frame.name), "a picture of --view");
    }
    if (!report.empty()) taken.take("--report", report);
    if (!trace.empty()) taken.take("--trace", trace);
}

}  // namespace clarus::cli
