#include "cli/frame_loop.h"

#include <algorithm>
#include <exception>
#include <future>
#include <map>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "clarus/error.h"
#include "cli/frame_description.h"
#include "cli/view_picture.h"
#include "io/alpha.h"
#include "io/image.h"
#include "metrics/display.h"

namespace clarus::cli {
namespace {

// One of the frames in flight: what the device reads and writes until `event`, and the thread that then writes files.
struct Slot {
    Slot() = default;
    Slot(const Slot&) = delete;
    Slot& operator=(const Slot&) = delete;
    ~Slot() {
        if (written.valid()) written.wait();  // Others hold this future, too: its own end would not wait.
        try {
            if (event) event->wait();
        } catch (const std::exception&) {  // Only reached while another error is on its way.
        }
    }

    size_t index = 0;
    SourceFrame frame;
    std::shared_ptr<Upscaler> upscaler;
    io::Pixels output, before;  // before: interpolated
    std::map<std::string, io::Pixels> views;
    FrameResult result;
    std::optional<FrameEvent> event;
    double seconds = 0;  // after the first frame
    std::shared_future<void> written;
};

class FrameLoop {
  public:
    FrameLoop(FrameSource& source, const ChooseUpscaler& choose, Interpolator* interpolator, const FrameOutput& output,
              size_t under_way, Trace& trace, const Finished& finished)
        : source_(source),
          choose_(choose),
          interpolator_(interpolator),
          output_(output),
          trace_(trace),
          finished_(finished),
          slots_(under_way) {}

    void run() {
        Slot* before = nullptr;  // on the device
        const auto finish_before = [&] {
            if (before) finish(*before);
            before = nullptr;
        };
        size_t index = 0;
        for (;; ++index) {
            Slot& slot = slot_of(index);
            hand_over(slot);
            if (source_.waits()) finish_before();
            try {
                if (!read(slot, index)) break;
            } catch (...) {
                finish_before();
                hand_over_all(index);
                throw;
            }
            if (output_.checkpoints && output_.checkpoints->is_due()) {
                finish_before();
                output_.checkpoints->take(index);
            }
            submit(slot);
            finish_before();
            before = &slot;
        }
        finish_before();
        hand_over_all(index);
    }

  private:
    Slot& slot_of(size_t frame) { return slots_[frame % slots_.size()]; }

    void hand_over(Slot& slot) {
        if (!slot.written.valid()) return;
        std::exchange(slot.written, {}).get();
        finished_(std::move(slot.result));
    }

    /// `frames`: that were submitted.
    void hand_over_all(size_t frames) {
        for (size_t i = frames; i < frames + slots_.size(); ++i) hand_over(slot_of(i));  // from the oldest on
        if (output_.checkpoints) output_.checkpoints->end(frames);
    }

    /// Whether there is a picture between the frame and the one before it.
    bool has_before(const Slot& slot) const { return interpolator_ && (slot.index != 0 || output_.goes_on); }

    bool read(Slot& slot, size_t index) {
        Trace::Span span(trace_, Trace::Track::main, "wait for input");
        std::optional<SourceFrame> frame = source_.next();
        if (!frame) return false;
        span.set_frame(frame->name);
        slot.index = index;
        slot.frame = std::move(*frame);
        slot.result = {};
        slot.result.name = slot.frame.name;
        slot.result.colors_without_numbers = slot.frame.colors_without_numbers;
        slot.result.is_depth_beyond_far = slot.frame.is_depth_beyond_far;
        slot.result.file = output_.file(slot.frame.name);
        return true;
    }

    static void allocate(io::Pixels& result, Size size, int channels) {
        result.size = size;
        result.channels = channels;
        result.values.resize(static_cast<size_t>(size.width) * size.height * result.channels);
    }

    void submit(Slot& slot) {
        const Trace::Span span(trace_, Trace::Track::main, "submit", slot.frame.name);
        slot.upscaler = choose_(slot.frame);
        submit(slot, slot.frame.inputs);
    }

    void submit(Slot& slot, FrameDescription frame) {
        allocate(slot.output, slot.upscaler->output_size(), output_.alpha ? 4 : 3);
        frame.output = image_of(slot.output);
        slot.event = slot.upscaler->submit(frame);
        for (const std::string& name : output_.views)
            slot.views[name] = view_picture(slot.upscaler->view(name), output_.view_size);
    }

    void finish(Slot& slot) {
        {
            const Trace::Span span(trace_, Trace::Track::main, "wait for device", slot.frame.name);
            wait(slot);
        }
        slot.result.invalid_motion_vectors = slot.event->invalid_motion_vectors();
        slot.event.reset();
        if (interpolator_) interpolate(slot);
        slot.frame.hold.reset();
        const Trace::Track track = Trace::writer(static_cast<size_t>(&slot - slots_.data()));
        if (slot.index != 0) seconds_ += slot.frame.seconds;
        slot.seconds = seconds_;
        // Moved on: a task that kept what it waited for would keep all frames before it.
        slot.written = std::async(std::launch::async, [this, &slot, track, before = last_written_]() mutable {
                           write(slot, track, std::move(before));
                       }).share();
        last_written_ = slot.written;
    }

    /// Where a device was lost while it had the frame, the frame is computed again by the others. The next one, which
    /// may be on its way, follows on what is gone.
    void wait(Slot& slot) {
        try {
            slot.event->wait();
        } catch (const Error&) {
            if (!output_.fallback) throw;
            FrameDescription frame = slot.frame.inputs;
            frame.reset = true;
            submit(slot, frame);
            slot.event->wait();
            slot.upscaler->reset();
        }
    }

    void interpolate(Slot& slot) {
        const Trace::Span span(trace_, Trace::Track::main, "interpolate", slot.frame.name);
        allocate(slot.before, slot.output.size, 3);
        FrameDescription frame = slot.frame.inputs;
        frame.color = image_of(slot.output);
        frame.output = image_of(slot.before);
        interpolator_->submit(frame).wait();
    }

    /// `before`: the frame before is written.
    void write(Slot& slot, Trace::Track track, std::shared_future<void> before) {
        const Trace::Span span(trace_, track, "write", slot.frame.name);
        const io::Pixels alpha = io::take_alpha(slot.output);
        if (!slot.frame.reference.values.empty()) {
            const auto display = [&](const io::Pixels& pixels) {
                return metrics::display_values(pixels, output_.color_space, slot.frame.inputs.exposure);
            };
            // As `clarus compare` will find it.
            const io::Pixels written = output_.folder.empty() ? slot.output : io::as_stored(slot.output, output_.type);
            slot.result.quality = metrics::measure(display(written), display(slot.frame.reference));
        }
        if (output_.writer) encode(slot, track, before);
        if (output_.shared) share(slot, track, before);
        if (output_.folder.empty()) return;
        const auto save = [&](const std::filesystem::path& file, const io::Pixels& pixels) {
            io::write_image(file, pixels, output_.type, output_.png_compression, output_.tags);
        };
        if (slot.frame.has_alpha && output_.alpha)
            save(slot.result.file, io::with_alpha(slot.output, alpha));
        else
            save(slot.result.file, slot.output);
        if (has_before(slot)) save(output_.file_before(slot.frame.name), slot.before);
        for (const auto& [name, picture] : slot.views)
            io::write_image(output_.view_file(name, slot.frame.name), picture, io::SampleType::u8,
                            output_.png_compression);
    }

    void encode(Slot& slot, Trace::Track track, const std::shared_future<void>& before) {
        const bool between = has_before(slot);
        const auto display = [&](io::Pixels& pixels) {
            if (output_.color_space == ColorSpace::linear)
                pixels = metrics::display_values(pixels, output_.color_space, slot.frame.inputs.exposure);
        };
        display(slot.output);
        if (between) display(slot.before);
        if (before.valid()) before.get();
        const Trace::Span span(trace_, track, "encode", slot.frame.name);
        if (between) output_.writer->write(slot.before, slot.seconds - slot.frame.seconds / 2, slot.frame.taken);
        output_.writer->write(slot.output, slot.seconds, slot.frame.taken);
    }

    void share(Slot& slot, Trace::Track track, const std::shared_future<void>& before) {
        if (before.valid()) before.get();
        const Trace::Span span(trace_, track, "share", slot.frame.name);
        output_.shared->write(slot.frame, slot.output, output_.color_space);
    }

    FrameSource& source_;
    const ChooseUpscaler& choose_;
    Interpolator* interpolator_;
    const FrameOutput& output_;
    Trace& trace_;
    const Finished& finished_;
    double seconds_ = 0;
    std::shared_future<void> last_written_;
    // Last: its writers use what is above.
    std::vector<Slot> slots_;
};

}  // namespace

size_t frames_under_way(const Upscaler& upscaler, const FrameOutput& output) {
    if (output.folder.empty() && !output.measure) return 2;  // nothing is encoded or measured
    constexpr size_t memory = size_t{1} << 30;
    const auto image = [](Size size, size_t channels) { return sizeof(float) * channels * size.width * size.height; };
    // Input is there twice: of as many frames to come.
    const size_t input = image(upscaler.render_size(), 6) + image(upscaler.output_size(), output.measure ? 3 : 0);
    const size_t results = image(upscaler.output_size(), 3) * (1 + output.interpolated) +
                           image(upscaler.output_size(), output.alpha ? 5 : 0) +
                           image(output.view_size, 3) * output.views.size();
    const size_t cores = std::max(1u, std::thread::hardware_concurrency());
    return std::clamp<size_t>(memory / (2 * input + results), 2, cores + 1);
}

void upscale_frames(FrameSource& source, const ChooseUpscaler& choose, Interpolator* interpolator,
                    const FrameOutput& output, size_t under_way, Trace& trace, const Finished& finished) {
    FrameLoop(source, choose, interpolator, output, under_way, trace, finished).run();
}

}  // namespace clarus::cli
