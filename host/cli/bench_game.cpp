#include "cli/bench_game.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "clarus/share.h"
#include "clarus/upscaler.h"
#include "cli/choice.h"
#include "cli/host_buffers.h"
#include "cli/share_error.h"
#include "measure/process_costs.h"
#include "measure/sharing_costs.h"
#include "measure/statistics.h"
#include "measure/test_sequence.h"
#include "measure/timed_upscaler.h"

namespace clarus::cli {
namespace {

using measure::GameTask;
using measure::GameTurn;
using measure::HandOver;
using measure::kSequenceFrames;
using measure::now;
using measure::TestFrame;

constexpr int kPatienceMilliseconds = 120000;  // of a game whose upscaler prepares
constexpr int kAlone = 15;                     // frames whose latency is measured
constexpr double kFast = 0.2;  // of these: what other work delays says nothing of the way that frames are handed over
constexpr size_t kPage = 4096;

struct Options {
    std::string stream, model, device;
    HandOver hand_over = HandOver::in_place;
    Size render_size;
    int slots = 3;
    pid_t upscaler = 0;
};

/// Where a frame is drawn, as floats: colour, depth, motion.
struct Canvas {
    float *color, *depth, *motion;
};

/// A canvas in the game's own memory, of whole pages, so that a device may use it in place.
class OwnCanvas {
  public:
    explicit OwnCanvas(Size size) {
        const size_t pixels = static_cast<size_t>(size.width) * size.height;
        for (size_t i = 0; i < images_.size(); ++i) {
            const size_t bytes = kChannels[i] * pixels * sizeof(float);
            images_[i].reset(static_cast<float*>(std::aligned_alloc(kPage, (bytes + kPage - 1) / kPage * kPage)));
        }
    }
    Canvas get() const { return {images_[0].get(), images_[1].get(), images_[2].get()}; }

  private:
    static constexpr std::array<size_t, 3> kChannels{3, 1, 2};
    std::array<std::unique_ptr<float, void (*)(void*)>, 3> images_{
        {{nullptr, std::free}, {nullptr, std::free}, {nullptr, std::free}}};
};

/// What becomes of the frames.
class Receiver {
  public:
    virtual ~Receiver() = default;
    /// Waits for a place to draw the next frame.
    virtual Canvas begin() = 0;
    /// It is drawn.
    virtual void end(const TestFrame& frame, bool reset) = 0;
    /// Waits for all frames to be upscaled.
    virtual void finish() = 0;
    virtual size_t slot_bytes() const { return 0; }

    /// Seconds that were waited for a place since the last call.
    double take_waited() { return std::exchange(waited_, 0); }

  protected:
    template <typename Wait>
    void wait_for_place(Wait wait) {
        const double start = now();
        wait();
        waited_ += now() - start;
    }

  private:
    double waited_ = 0;
};

/// Two frames under way, read where they were drawn if the device shares the host's memory.
class InProcess : public Receiver {
  public:
    explicit InProcess(const Options& options)
        : device_(Device::open(options.device)),
          upscaler_(device_, Model::find(options.model, 2), options.render_size, {}),
          size_(options.render_size) {
        upscaler_.prepare();
        if (device_.profile().unified_memory && device_.is_one_context()) buffers_.emplace(device_, nullptr);
        const Size output = upscaler_.output_size();
        for (Place& place : places_) {
            place.canvas = std::make_unique<OwnCanvas>(size_);
            place.output.resize(size_t{3} * output.width * output.height);
        }
    }

    Canvas begin() override {
        Place& place = places_[next_];
        wait_for_place([&] {
            if (place.event) place.event->wait();
        });
        place.event.reset();
        return place.canvas->get();
    }

    void end(const TestFrame& frame, bool reset) override {
        Place& place = places_[next_];
        next_ = (next_ + 1) % places_.size();
        const Canvas canvas = place.canvas->get();
        const auto image = [&](float* pixels, size_t channels) {
            return Image{.host = pixels, .row_pitch = channels * sizeof(float) * size_.width, .size = size_};
        };
        FrameDescription description;
        description.color = image(canvas.color, 3);
        description.depth = image(canvas.depth, 1);
        description.motion = image(canvas.motion, 2);
        description.jitter = frame.jitter;
        description.reset = reset;
        if (buffers_) buffers_->replace({&description.color, &description.depth, &description.motion});
        description.output = {.host = place.output.data(), .size = upscaler_.output_size()};
        place.event = upscaler_.submit(description);
    }

    void finish() override {
        for (Place& place : places_) {
            if (place.event) place.event->wait();
            place.event.reset();
        }
    }

  private:
    struct Place {
        std::unique_ptr<OwnCanvas> canvas;
        std::vector<float> output;
        std::optional<FrameEvent> event;
    };
    Device device_;
    Upscaler upscaler_;
    Size size_;
    std::array<Place, 2> places_;
    std::optional<HostBuffers> buffers_;
    size_t next_ = 0;
};

/// Shared with `clarus serve`.
class Shared : public Receiver {
  public:
    explicit Shared(const Options& options) : stream_(open(options), clarus_share_close) {
        if (options.hand_over == HandOver::copied) canvas_.emplace(options.render_size);
    }

    Canvas begin() override {
        if (canvas_) return canvas_->get();
        begin_slot();
        const auto pixels = [&](clarus_share_kind kind) { return static_cast<float*>(frame_.images[kind].pixels); };
        return {pixels(CLARUS_SHARE_COLOR), pixels(CLARUS_SHARE_DEPTH), pixels(CLARUS_SHARE_MOTION)};
    }

    void end(const TestFrame& drawn, bool reset) override {
        if (canvas_) {
            begin_slot();
            const Canvas canvas = canvas_->get();
            check_share(clarus_share_copy(&frame_, CLARUS_SHARE_COLOR, canvas.color, 0));
            check_share(clarus_share_copy(&frame_, CLARUS_SHARE_DEPTH, canvas.depth, 0));
            check_share(clarus_share_copy(&frame_, CLARUS_SHARE_MOTION, canvas.motion, 0));
        }
        frame_.jitter_x = drawn.jitter.x;
        frame_.jitter_y = drawn.jitter.y;
        frame_.reset = reset;
        check_share(clarus_share_end(stream_.get(), &frame_));
    }

    void finish() override { check_share(clarus_share_drain(stream_.get(), kPatienceMilliseconds)); }

    size_t slot_bytes() const override {
        size_t bytes = 0;
        for (const clarus_share_resource& resource : description_.resources)
            bytes += sizeof(float) * resource.format.channels * resource.width * resource.height;
        return description_.slots * bytes;
    }

  private:
    clarus_share_stream* open(const Options& options) {
        description_ = clarus_share_default_description();
        const auto resource = [&](int channels) {
            return clarus_share_resource{
                {CLARUS_F32, channels}, options.render_size.width, options.render_size.height, 0};
        };
        description_.resources[CLARUS_SHARE_COLOR] = resource(3);
        description_.resources[CLARUS_SHARE_DEPTH] = resource(1);
        description_.resources[CLARUS_SHARE_MOTION] = resource(2);
        description_.slots = options.slots;
        clarus_share_stream* stream = nullptr;
        check_share(clarus_share_open(options.stream.c_str(), &description_, &stream));
        return stream;
    }

    void begin_slot() {
        wait_for_place([&] { check_share(clarus_share_begin(stream_.get(), kPatienceMilliseconds, &frame_)); });
    }

    clarus_share_description description_{};
    std::unique_ptr<clarus_share_stream, void (*)(clarus_share_stream*)> stream_;
    std::optional<OwnCanvas> canvas_;
    clarus_share_frame frame_{};
};

/// Plays the test sequence's frames, of which the first is a cut and the others follow each other again and again.
class Game {
  public:
    explicit Game(const Options& options) : upscaler_(options.upscaler) {
        for (int index = 0; index < kSequenceFrames; ++index)
            frames_.push_back(measure::test_frame(options.render_size, index));
        if (options.hand_over == HandOver::in_process)
            receiver_ = std::make_unique<InProcess>(options);
        else
            receiver_ = std::make_unique<Shared>(options);
    }

    GameTurn play(const GameTask& task) {
        GameTurn turn;
        turn.latency = latency_alone();
        receiver_->take_waited();
        double waited = 0;
        const double start = now(), processor = measure::processor_seconds(getpid()),
                     upscaler_processor = measure::processor_seconds(upscaler_);
        for (int index = 0; index < task.frames; ++index) {
            if (task.render_seconds > 0)
                std::this_thread::sleep_for(std::chrono::duration<double>(task.render_seconds));
            draw(index);
            waited += receiver_->take_waited();
            const double drawn = now();
            hand_over(index);
            turn.hand_over += now() - drawn;
            const double late = receiver_->take_waited();  // it draws before it waits for a place to copy to
            waited += late;
            turn.hand_over -= late;
        }
        receiver_->finish();
        const double frames = task.frames;
        turn.period = (now() - start) / frames;
        turn.wait = waited / frames;
        turn.hand_over /= frames;
        turn.processor = (measure::processor_seconds(getpid()) - processor) / frames;
        turn.memory = static_cast<double>(measure::occupied_bytes(getpid()));
        turn.slots = static_cast<double>(receiver_->slot_bytes());
        if (upscaler_ == 0) return turn;
        turn.upscaler_processor = (measure::processor_seconds(upscaler_) - upscaler_processor) / frames;
        turn.upscaler_memory = static_cast<double>(measure::occupied_bytes(upscaler_));
        return turn;
    }

  private:
    static int frame_of(int index) { return index == 0 ? 0 : 1 + (index - 1) % (kSequenceFrames - 1); }

    void draw(int index) {
        const TestFrame& frame = frames_[frame_of(index)];
        const Canvas canvas = receiver_->begin();
        std::copy(frame.color.begin(), frame.color.end(), canvas.color);
        std::copy(frame.depth.begin(), frame.depth.end(), canvas.depth);
        std::copy(frame.motion.begin(), frame.motion.end(), canvas.motion);
    }
    void hand_over(int index) { receiver_->end(frames_[frame_of(index)], index == 0); }

    double latency_alone() {
        std::vector<double> latencies;
        for (int index = 0; index <= kAlone; ++index) {
            draw(index);
            const double drawn = now();
            hand_over(index);
            receiver_->finish();
            if (index > 0) latencies.push_back(now() - drawn);
        }
        return measure::quantile(latencies, kFast);
    }

    pid_t upscaler_;
    std::vector<TestFrame> frames_;
    std::unique_ptr<Receiver> receiver_;
};

void play(const Options& options) {
    Game game(options);
    for (std::string line; std::getline(std::cin, line);) {
        fmt::print("{}\n", measure::line_of(game.play(measure::read_task(line))));
        std::fflush(stdout);
    }
}

}  // namespace

void add_bench_game_command(CLI::App& bench) {
    CLI::App& command = *bench.add_subcommand("game", "Share frames and say what that cost: what `share` measures by");
    const auto options = std::make_shared<Options>();
    command.group("");  // of no use to others
    command.fallthrough(false);
    command.add_option("STREAM", options->stream)->required();
    add_choice<HandOver, HandOver>(command, "HAND-OVER", options->hand_over,
                                   {{measure::name_of(HandOver::in_process), HandOver::in_process},
                                    {measure::name_of(HandOver::copied), HandOver::copied},
                                    {measure::name_of(HandOver::in_place), HandOver::in_place}},
                                   "");
    command.add_option("MODEL", options->model)->required();
    command.add_option("DEVICE", options->device)->required();
    command.add_option("WIDTH", options->render_size.width)->required();
    command.add_option("HEIGHT", options->render_size.height)->required();
    command.add_option("SLOTS", options->slots)->required();
    command.add_option("UPSCALER", options->upscaler)->required();
    command.callback([options] { play(*options); });
}

}  // namespace clarus::cli
