#include <algorithm>
#include <atomic>
#include <deque>
#include <memory>
#include <mutex>
#include <random>
#include <thread>
#include <utility>

#include "base/log.h"
#include "clarus/share.h"
#include "link/sides.h"
#include "share/events.h"
#include "share/layout.h"

namespace clarus::link {
namespace {

using namespace std::chrono_literals;

constexpr int kLookMilliseconds = 50;  // how long the end of this link may take to be seen
constexpr auto kRetry = 100ms;         // between attempts to connect
constexpr int kQuickTries = 30;
constexpr auto kSlowRetry = 500ms;  // after those
constexpr auto kRefusedRetry = 1000ms;
constexpr int kDrainMilliseconds = 1000;  // that the last word may take

uint64_t new_session() {
    std::random_device random;
    return uint64_t{random()} << 32 | random();
}

class Sender : public Link {
  public:
    Sender(const std::string& name, RemoteStream to) : name_(name), to_(std::move(to)) {
        clarus_share_reader* reader = nullptr;
        if (clarus_share_reader_open(name.c_str(), &reader) != CLARUS_SHARE_OK)
            fail(ErrorKind::invalid_argument, "{}", clarus_share_last_error());
        reader_.reset(reader);
        resolve(to_.address);  // so that what cannot be is told at once
        Worker{device_towards(resolve(to_.address))};
        thread_ = std::thread([this] { run(); });
    }
    ~Sender() override {
        stop_ = true;
        bell_.ring();
        thread_.join();
    }

    LinkState state() const override {
        const std::lock_guard lock(mutex_);
        return state_;
    }
    void finish(int milliseconds) override {
        const auto until = Clock::now() + std::chrono::milliseconds(milliseconds);
        while (Clock::now() < until && !state().ended && state().failure.empty())
            std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }

  private:
    /// A frame of the stream that is held here until the other side is done with it.
    struct Held {
        clarus_share_frame frame;
        uint64_t index;
        bool is_sent = false;
        bool is_gone = false;  // its bytes are with the other side
    };

    struct Connection {
        explicit Connection(const SocketAddress& to) : worker(device_towards(to)), endpoint(worker, to) {}
        Worker worker;
        Endpoint endpoint;  // goes first
        bool is_welcome = false;
        Clock::time_point heard = Clock::now(), said = Clock::now();
    };

    void change(const std::function<void(LinkState&)>& change) {
        const std::lock_guard lock(mutex_);
        change(state_);
    }

    void run() {
        try {
            while (!stop_) {
                const clarus_share_status status = clarus_share_reader_connect(reader_.get(), kLookMilliseconds);
                if (status == CLARUS_SHARE_OK)
                    carry();
                else
                    wait_for_renderer(status);
                if (state().ended) return;
            }
        } catch (const std::exception& error) {
            change([&](LinkState& state) { state.failure = error.what(); });
            log(LogLevel::warning, "the link to {} has ended: {}", to_.address.text(), error.what());
        }
    }

    /// One that takes no other reader, or that is of another version, may go; one that is not there may come.
    void wait_for_renderer(clarus_share_status status) {
        const bool may_come = status == CLARUS_SHARE_NO_STREAM || status == CLARUS_SHARE_TIMED_OUT ||
                              status == CLARUS_SHARE_GONE || status == CLARUS_SHARE_CANCELLED;
        if (may_come) return std::this_thread::sleep_for(1ms);
        if (const std::string why = clarus_share_last_error(); why != trouble_) {
            trouble_ = why;
            log(LogLevel::warning, "{}; trying again", why);
        }
        for (auto until = Clock::now() + kRefusedRetry; Clock::now() < until && !stop_;)
            std::this_thread::sleep_for(kRetry);
    }

    bool takes_every_frame() const {
        return clarus_share_reader_description(reader_.get())->policy == CLARUS_SHARE_EVERY_FRAME;
    }
    size_t window() const { return takes_every_frame() ? clarus_share_reader_description(reader_.get())->slots : 1; }

    /// All frames of one connection to the stream.
    void carry() {
        session_ = new_session();
        next_ = 0;
        held_.clear();
        over_ = CLARUS_SHARE_OK;
        left_ = false;
        memory_ = static_cast<const std::byte*>(clarus_share_reader_memory(reader_.get(), &slot_bytes_));
        while (!stop_ && !left_) {
            if (!connection_) connect();
            if (connection_) {
                connection_->worker.progress();
                hear();
            }
            if (connection_ && is_lost()) disconnect();
            if (connection_ && connection_->is_welcome) {
                take_frames();
                send_frames();
                show_life();
                if (over_ != CLARUS_SHARE_OK && held_.empty()) break;
            }
            wait();
        }
        say_goodbye();
        disconnect();
        if (over_ == CLARUS_SHARE_ENDED && held_.empty()) change([](LinkState& state) { state.ended = true; });
    }

    void connect() {
        if (Clock::now() < retry_at_) return;
        retry_at_ = Clock::now() + (++tries_ < kQuickTries ? kRetry : kSlowRetry);
        try {
            connection_ = std::make_unique<Connection>(resolve(to_.address));
        } catch (const Error& error) {
            tell_trouble(error.what());
            return;
        }
        // The newest frame alone is of use: what was held when a link broke is not.
        if (!takes_every_frame()) release_until(next_);
        Hello hello{};
        hello.head = share_make_head(kHello, sizeof hello);
        hello.session = session_;
        hello.first = held_.empty() ? next_ : held_.front().index;
        std::strncpy(hello.name, to_.name.c_str(), sizeof hello.name - 1);
        clarus_share_description description = *clarus_share_reader_description(reader_.get());
        share_layout layout;
        share_lay_out(&description, &layout);
        share_describe_to_wire(&description, &layout, &hello.stream);
        hello.stream.head = share_make_head(SHARE_STREAM, sizeof hello.stream);
        connection_->endpoint.send(hello);
        for (Held& held : held_) held.is_sent = held.is_gone = false;
    }

    bool is_lost() {
        if (connection_->endpoint.is_broken()) {
            const std::string why = connection_->endpoint.why();
            tell_trouble(connection_->is_welcome ? why : fmt::format("nobody takes frames there ({})", why));
            return true;
        }
        if (Clock::now() - connection_->heard < kSilence) return false;
        tell_trouble("nothing is heard of the other side");
        return true;
    }

    void disconnect() {
        connection_.reset();
        change([](LinkState& state) { state.connected = false; });
    }

    /// Once until it changes.
    void tell_trouble(const std::string& what) {
        if (what == trouble_) return;
        trouble_ = what;
        log(LogLevel::warning, "no link to {}: {}; trying again", to_.address.text(), what);
    }

    void hear() {
        std::deque<Message>& messages = connection_->worker.messages;
        while (connection_ && !messages.empty()) {
            const Message message = std::move(messages.front());
            messages.pop_front();
            connection_->worker.drop(message);  // nothing with data is due here
            connection_->heard = Clock::now();
            const uint32_t type = type_of(message);
            if (type == SHARE_LEAVE) return hear_leave(message);
            if (type == kAlive) continue;
            const std::optional<Progress> progress = read<Progress>(message, kProgress);
            const uint64_t first = held_.empty() ? next_ : held_.front().index;
            if (!progress || progress->received > next_ || progress->released > progress->received ||
                progress->received < first) {
                const std::string why =
                    progress ? "it received frames that there never were" : std::string(clarus_share_last_error());
                connection_->endpoint.send(leave_word(SHARE_NONSENSE, why));
                connection_->endpoint.flush(kGoodbyeMilliseconds);
                return give_up(why);
            }
            if (!connection_->is_welcome) welcome(*progress);
            if (takes_every_frame()) release_until(progress->released);
        }
    }

    void welcome(const Progress& progress) {
        connection_->is_welcome = true;
        is_first_ = true;
        trouble_.clear();
        tries_ = 0;
        for (Held& held : held_) held.is_sent = held.is_gone = held.index < progress.received;
        change([](LinkState& state) {
            state.connected = true;
            ++state.connections;
        });
        log(LogLevel::info, "linked to {}, stream {}", to_.address.text(), to_.name);
    }

    void hear_leave(const Message& message) {
        const auto leave = begin_of<share_leave>(message);
        char words[SHARE_TEXT_BYTES];
        share_words(&leave, message.header.size(), words);
        if (leave.reason == SHARE_ENDS) {
            tell_trouble(*words ? words : "the other side has left");
            return disconnect();
        }
        give_up(words);
    }

    /// The renderer is told, as by an upscaler of this machine; it goes on, and so does this.
    void give_up(const std::string& why) {
        tell_trouble(why);
        retry_at_ = Clock::now() + kRefusedRetry;
        disconnect();
        clarus_share_reader_refuse(reader_.get(), why.c_str());
        left_ = true;
    }

    void release_until(uint64_t index) {
        while (!held_.empty() && held_.front().index < index) {
            held_.pop_front();
            clarus_share_reader_release(reader_.get());
        }
    }

    void take_frames() {
        while (over_ == CLARUS_SHARE_OK && held_.size() < window()) {
            clarus_share_frame frame;
            const clarus_share_status status = clarus_share_reader_wait(reader_.get(), 0, &frame);
            if (status == CLARUS_SHARE_OK)
                held_.push_back({frame, next_++});
            else if (status == CLARUS_SHARE_TIMED_OUT)
                return;
            else
                over_ = status;
        }
    }

    void send_frames() {
        for (Held& held : held_) {
            if (held.is_sent) continue;
            held.is_sent = true;
            if (is_first_) held.frame.reset = 1;  // what was before it may not have come
            is_first_ = false;
            Frame message{};
            message.head = share_make_head(kFrame, sizeof message);
            message.index = held.index;
            share_frame_to_wire(&held.frame, held.index, &message.frame);
            const std::byte* slot = memory_ + static_cast<size_t>(held.frame.slot) * slot_bytes_;
            connection_->endpoint.send(message, slot + SHARE_PAGE_BYTES, slot_bytes_ - SHARE_PAGE_BYTES,
                                       [this, index = held.index](bool sent) {
                                           if (sent) frame_went(index);
                                       });
        }
        if (!takes_every_frame() && !held_.empty() && held_.front().is_gone) release_until(held_.front().index + 1);
    }

    void frame_went(uint64_t index) {
        change([](LinkState& state) { ++state.frames; });
        for (Held& held : held_)
            if (held.index == index) held.is_gone = true;
    }

    void show_life() {
        if (Clock::now() - connection_->said < kHeartbeat) return;
        connection_->said = Clock::now();
        connection_->endpoint.send(Alive{share_make_head(kAlive, sizeof(Alive))});
    }

    void say_goodbye() {
        if (!connection_ || !connection_->is_welcome) return;
        connection_->endpoint.flush(kDrainMilliseconds);
        const bool has_ended = over_ == CLARUS_SHARE_ENDED && held_.empty();
        connection_->endpoint.send(
            has_ended ? leave_word(SHARE_ENDS, "the renderer closed the stream")
                      : leave_word(SHARE_REFUSES, over_ == CLARUS_SHARE_OK ? "the link was ended at the renderer's side"
                                                                           : "the renderer has gone"));
        connection_->endpoint.flush(kGoodbyeMilliseconds);
        // It closes first: what closes at once may take words along that are under way.
        const auto until = Clock::now() + std::chrono::milliseconds(kGoodbyeMilliseconds);
        while (!connection_->endpoint.is_broken() && Clock::now() < until) connection_->worker.wait({}, 10);
    }

    void wait() {
        std::vector<int> descriptors{bell_.descriptor()};
        if (!connection_) {
            // Only time helps.
            return std::this_thread::sleep_for(std::clamp<Clock::duration>(retry_at_ - Clock::now(), 0ms, kRetry));
        }
        if (connection_->is_welcome && over_ == CLARUS_SHARE_OK && held_.size() < window()) {
            descriptors.resize(1 + SHARE_READER_EVENTS);
            share_reader_events(reader_.get(), &descriptors[1]);
        }
        connection_->worker.wait(descriptors, kLookMilliseconds);
    }

    std::string name_;
    RemoteStream to_;
    std::unique_ptr<clarus_share_reader, void (*)(clarus_share_reader*)> reader_{nullptr, clarus_share_reader_close};
    std::unique_ptr<Connection> connection_;  // goes before the memory that it sends from
    Clock::time_point retry_at_{};
    int tries_ = 0;
    std::string trouble_;

    uint64_t session_ = 0, next_ = 0;
    std::deque<Held> held_;
    const std::byte* memory_ = nullptr;
    size_t slot_bytes_ = 0;
    clarus_share_status over_ = CLARUS_SHARE_OK;  // how the stream ended
    bool left_ = false;
    bool is_first_ = true;

    mutable std::mutex mutex_;
    LinkState state_;
    Bell bell_;
    std::atomic<bool> stop_ = false;
    std::thread thread_;
};

}  // namespace

std::unique_ptr<Link> make_sender(const std::string& name, const RemoteStream& to) {
    return std::make_unique<Sender>(name, to);
}

}  // namespace clarus::link
