#include "cli/frame_loop.h"

#include <algorithm>
#include <exception>
#include <future>
#include <map>
#include <thread>
#include <utility>
#include <vector>

#include "cli/frame_description.h"
#include "cli/progress.h"
#include "cli/view_picture.h"
#include "io/frames.h"
#include "metrics/display.h"

namespace clarus::cli {
namespace {

// One of the frames in flight: what the device reads and writes until `event`, and the thread that then writes files.
struct Slot {
    Slot() = default;
    Slot(const Slot&) = delete;
    Slot& operator=(const Slot&) = delete;
    ~Slot() {
        try {
            if (event) event->wait();
        } catch (const std::exception&) {  // Only reached while another error is on its way.
        }
    }

    io::FramePixels input;
    io::Pixels output, before;  // before: interpolated
    std::map<std::string, io::Pixels> views;
    FrameResult* result = nullptr;
    const io::FrameFiles* files = nullptr;
    std::optional<FrameEvent> event;
    std::future<void> written;
};

/// One frame is on the device and one with each core that encodes, as far as memory goes.
size_t frames_under_way(const Upscaler& upscaler, const FrameOutput& output) {
    constexpr size_t memory = size_t{1} << 30;
    const auto image = [](Size size, size_t channels) { return sizeof(float) * channels * size.width * size.height; };
    // Input is there twice: of as many frames to come.
    const size_t input = image(upscaler.render_size(), 6) + image(upscaler.output_size(), output.measure ? 3 : 0);
    const size_t results =
        image(upscaler.output_size(), 3) * (1 + output.interpolated) + image(output.view_size, 3) * output.views.size();
    const size_t cores = std::max(1u, std::thread::hardware_concurrency());
    return std::clamp<size_t>(memory / (2 * input + results), 2, cores + 1);
}

class FrameLoop {
  public:
    FrameLoop(const io::Sequence& sequence, Upscaler& upscaler, Interpolator* interpolator, const FrameOutput& output,
              Trace& trace)
        : sequence_(sequence),
          upscaler_(upscaler),
          interpolator_(interpolator),
          output_(output),
          trace_(trace),
          reader_(sequence, 0, sequence.frames.size(),
                  interpolator || upscaler.needs_depth() || upscaler.needs_motion(), output.measure,
                  frames_under_way(upscaler, output)),
          results_(sequence.frames.size()),
          slots_(frames_under_way(upscaler, output)) {}

    std::vector<FrameResult> run() {
        Progress progress("upscaling");
        const size_t count = sequence_.frames.size();
        for (size_t i = 0; i < count; ++i) {
            Slot& slot = slot_of(i);
            if (slot.written.valid()) slot.written.get();
            try {
                read(slot, i);
            } catch (...) {
                if (i > 0) finish(slot_of(i - 1));
                throw;
            }
            if (i == 0) trace_.device_starts();
            submit(slot);
            if (i > 0) finish(slot_of(i - 1));
            progress.update(i, count);
        }
        finish(slot_of(count - 1));
        for (size_t i = count; i < count + slots_.size(); ++i)  // from the oldest on
            if (slot_of(i).written.valid()) slot_of(i).written.get();
        return std::move(results_);
    }

  private:
    Slot& slot_of(size_t frame) { return slots_[frame % slots_.size()]; }

    void read(Slot& slot, size_t index) {
        slot.files = &sequence_.frames[index];
        slot.result = &results_[index];
        slot.result->name = slot.files->name;
        slot.result->file = output_.file(slot.files->name);

        const Trace::Span span(trace_, Trace::Track::main, "wait for input", slot.files->name);
        slot.input = std::move(reader_.next()->pixels);
        allocate(slot.output);
        if (interpolator_) allocate(slot.before);
    }

    void allocate(io::Pixels& result) const {
        result.size = upscaler_.output_size();
        result.channels = 3;
        result.values.resize(static_cast<size_t>(result.size.width) * result.size.height * result.channels);
    }

    FrameDescription description(Slot& slot) const { return describe_frame(sequence_, *slot.files, slot.input); }

    void submit(Slot& slot) {
        const Trace::Span span(trace_, Trace::Track::main, "submit", slot.files->name);
        FrameDescription frame = description(slot);
        frame.output = image_of(slot.output);
        slot.event = upscaler_.submit(frame);
        for (const std::string& name : output_.views)
            slot.views[name] = view_picture(upscaler_.view(name), output_.view_size);
    }

    void finish(Slot& slot) {
        {
            const Trace::Span span(trace_, Trace::Track::main, "wait for device", slot.files->name);
            slot.event->wait();
        }
        slot.result->invalid_motion_vectors = slot.event->invalid_motion_vectors();
        slot.event.reset();
        if (interpolator_) interpolate(slot);
        const Trace::Track track = Trace::writer(static_cast<size_t>(&slot - slots_.data()));
        slot.written = std::async(std::launch::async, [this, &slot, track] { write(slot, track); });
    }

    void interpolate(Slot& slot) {
        const Trace::Span span(trace_, Trace::Track::main, "interpolate", slot.files->name);
        FrameDescription frame = description(slot);
        frame.color = image_of(slot.output);
        frame.output = image_of(slot.before);
        interpolator_->submit(frame).wait();
    }

    void write(Slot& slot, Trace::Track track) {
        const Trace::Span span(trace_, track, "write", slot.files->name);
        if (!slot.input.reference.values.empty()) {
            const auto display = [&](const io::Pixels& pixels) {
                return metrics::display_values(pixels, sequence_.color_space, slot.files->exposure);
            };
            slot.result->quality = metrics::measure(display(slot.output), display(slot.input.reference));
        }
        const io::SampleType type = output_.extension == ".exr" ? io::SampleType::f32 : io::SampleType::u8;
        const auto save = [&](const std::filesystem::path& file, const io::Pixels& pixels, io::SampleType samples) {
            io::write_image(file, pixels, samples, output_.png_compression);
        };
        save(slot.result->file, slot.output, type);
        if (interpolator_ && slot.files != &sequence_.frames.front())
            save(output_.file_before(slot.files->name), slot.before, type);
        for (const auto& [name, picture] : slot.views)
            save(output_.view_file(name, slot.files->name), picture, io::SampleType::u8);
    }

    const io::Sequence& sequence_;
    Upscaler& upscaler_;
    Interpolator* interpolator_;
    const FrameOutput& output_;
    Trace& trace_;
    io::FrameReader reader_;
    std::vector<FrameResult> results_;
    // Last: its writers use what is above.
    std::vector<Slot> slots_;
};

}  // namespace

std::vector<FrameResult> upscale_frames(const io::Sequence& sequence, Upscaler& upscaler, Interpolator* interpolator,
                                        const FrameOutput& output, Trace& trace) {
    return FrameLoop(sequence, upscaler, interpolator, output, trace).run();
}

}  // namespace clarus::cli
