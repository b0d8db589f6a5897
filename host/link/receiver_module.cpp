#include <algorithm>
#include <atomic>
#include <deque>
#include <list>
#include <memory>
#include <mutex>
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
constexpr auto kPatience = 2000ms;     // who connects and says nothing for so long is turned away
constexpr size_t kMostConnections = 8;
constexpr int kWordMilliseconds = 300;  // that last words may take to go
constexpr auto kStuck = 2000ms;         // that fetching from a connection that is gone may take to end
constexpr int kListenAgainMilliseconds = 20;

class Receiver : public Link {
  public:
    Receiver(const std::string& name, Address at) : name_(name), at_(std::move(at)) {
        start_listening();
        thread_ = std::thread([this] { run(); });
    }
    ~Receiver() override {
        stop_ = true;
        bell_.ring();
        thread_.join();
    }

    LinkState state() const override {
        const std::lock_guard lock(mutex_);
        return state_;
    }
    void finish(int) override {}  // it never ends

  private:
    struct Connection {
        Connection(Worker& worker, ucp_conn_request_h request) : endpoint(worker, request) {}
        Endpoint endpoint;
        Clock::time_point since = Clock::now(), heard = since, said = since;
        bool is_told = false;  // why it is refused; what it says then is not heard
        bool is_left = false;  // and goes
    };

    struct Arrived {  // a frame whose bytes are still with the sender
        Message message;
        share_frame_header header;
    };

    void change(const std::function<void(LinkState&)>& change) {
        const std::lock_guard lock(mutex_);
        change(state_);
    }

    void start_listening() {
        const SocketAddress own = resolve(at_);
        worker_ = std::make_unique<Worker>(device_at(own));
        worker_->listen(at_);
    }

    void run() {
        try {
            while (!stop_) step();
            attend_stream();  // whose upscaler may have said why it goes
            if (sender_) say_goodbye(*sender_, SHARE_ENDS, "the upscaler has ended");
            const auto is_there = [](const Connection& each) { return !each.endpoint.is_broken(); };
            const auto until = Clock::now() + std::chrono::milliseconds(kWordMilliseconds);
            while (std::ranges::any_of(connections_, is_there) && Clock::now() < until) worker_->wait({}, 10);
        } catch (const std::exception& error) {
            change([&](LinkState& state) { state.failure = error.what(); });
            log(LogLevel::warning, "frames come no more to {}: {}", at_.text(), error.what());
        }
        connections_.clear();
        worker_.reset();
        share_stream_abandon(stream_);
    }

    void step() {
        worker_->progress();
        let_in();
        hear();
        forget_the_left();
        attend_stream();
        fetch_next();
        report();
        std::vector<int> descriptors{bell_.descriptor()};
        if (stream_) {
            descriptors.resize(1 + SHARE_STREAM_EVENTS);
            share_stream_events(stream_, &descriptors[1]);
        }
        worker_->wait(descriptors, kLookMilliseconds);
    }

    // ---- connections ----

    void let_in() {
        for (; !worker_->requests.empty(); worker_->requests.pop_front()) {
            try {
                connections_.emplace_back(*worker_, worker_->requests.front());
            } catch (const Error& error) {
                log(LogLevel::info, "somebody who wanted to connect is gone: {}", error.what());
            }
        }
        // The oldest that has said nothing makes room.
        while (connections_.size() > kMostConnections) {
            const auto silent =
                std::ranges::find_if(connections_, [&](const Connection& each) { return &each != sender_; });
            remove(silent);
        }
    }

    void remove(std::list<Connection>::iterator connection) {
        const ucp_ep_h endpoint = connection->endpoint.get();
        if (&*connection == sender_) {
            sender_ = nullptr;
            change([](LinkState& state) { state.connected = false; });
        }
        connections_.erase(connection);
        if (is_fetching_ && fetching_from_ == endpoint) is_orphaned_ = true;
        for (const Arrived& arrived : arrived_)
            if (arrived.message.from == endpoint) worker_->drop(arrived.message);
        std::erase_if(arrived_, [&](const Arrived& arrived) { return arrived.message.from == endpoint; });
        for (const Message& message : worker_->messages)
            if (message.from == endpoint) worker_->drop(message);
        std::erase_if(worker_->messages, [&](const Message& message) { return message.from == endpoint; });
    }

    void forget_the_left() {
        for (auto each = connections_.begin(); each != connections_.end();) {
            const auto connection = each++;
            if (connection->endpoint.is_broken() && &*connection == sender_)
                log(LogLevel::warning, "the link from the renderer's machine is broken: {}; waiting for it",
                    connection->endpoint.why());
            const bool is_mute = &*connection != sender_ && Clock::now() - connection->since > kPatience;
            if (connection->endpoint.is_broken() || connection->is_left || is_mute) remove(connection);
        }
        if (is_fetching_ && is_orphaned_ && Clock::now() - fetching_since_ > kStuck) listen_anew();
    }

    /// What was being fetched is written no more once its worker has gone.
    void listen_anew() {
        arrived_.clear();
        sender_ = nullptr;
        connections_.clear();
        worker_.reset();
        is_fetching_ = false;
        change([](LinkState& state) { state.connected = false; });
        for (;;) {
            try {
                return start_listening();
            } catch (const Error&) {
                if (stop_ || Clock::now() - fetching_since_ > 10 * kStuck) throw;
                std::this_thread::sleep_for(std::chrono::milliseconds(kListenAgainMilliseconds));
            }
        }
    }

    void say_goodbye(Connection& connection, uint32_t reason, const std::string& why) {
        connection.endpoint.send(leave_word(reason, why));
        connection.since = Clock::now();
        connection.is_told = true;
        if (&connection != sender_) return;
        sender_ = nullptr;
        change([](LinkState& state) { state.connected = false; });
    }

    /// It is told, and has kPatience to go by itself.
    void refuse(Connection& connection, uint32_t reason, const std::string& why) {
        log(LogLevel::warning, "a machine that wanted to send frames of {} is refused: {}", name_, why);
        say_goodbye(connection, reason, why);
        for (const Arrived& arrived : arrived_)
            if (arrived.message.from == connection.endpoint.get()) worker_->drop(arrived.message);
        std::erase_if(arrived_,
                      [&](const Arrived& arrived) { return arrived.message.from == connection.endpoint.get(); });
    }

    // ---- messages ----

    void hear() {
        for (; !worker_->messages.empty();) {
            const Message message = std::move(worker_->messages.front());
            worker_->messages.pop_front();
            const auto connection = std::ranges::find_if(
                connections_, [&](const Connection& each) { return each.endpoint.get() == message.from; });
            if (connection == connections_.end() || connection->is_told) {
                worker_->drop(message);
                continue;
            }
            connection->heard = Clock::now();
            const uint32_t type = type_of(message);
            if (&*connection == sender_ && type == kFrame && hear_frame(message)) continue;
            worker_->drop(message);  // a frame that was not taken, or data where none are due
            if (&*connection == sender_)
                hear_sender(*connection, message, type);
            else
                hear_stranger(*connection, message);
        }
    }

    void hear_stranger(Connection& connection, const Message& message) {
        clarus_share_status status;
        const std::optional<Hello> hello = read<Hello>(message, kHello, &status);
        if (!hello)
            return refuse(connection, status == CLARUS_SHARE_VERSION ? SHARE_OTHER_VERSION : SHARE_NONSENSE,
                          clarus_share_last_error());
        const std::string name(hello->name, strnlen(hello->name, sizeof hello->name));
        if (name != name_)
            return refuse(connection, SHARE_REFUSES,
                          fmt::format("{} is served here, not {:.80}", name_, printable(name)));
        if (sender_ && hello->session != session_ && Clock::now() - sender_->heard < kSilence)
            return refuse(connection, SHARE_REFUSES, "the stream has a renderer on another machine already");
        if (sender_) {  // it has come back before its end was seen
            Connection& before = *sender_;
            sender_ = nullptr;
            before.is_left = true;
        }
        const bool is_same =
            stream_ && hello->session == session_ && std::memcmp(&hello->stream, &said_, sizeof said_) == 0;
        if (!is_same && !open_stream(connection, *hello)) return;
        if (hello->first > received_) {
            if (description_.policy == CLARUS_SHARE_EVERY_FRAME)
                return refuse(connection, SHARE_NONSENSE, "it begins after frames that did not come");
            base_ += hello->first - received_;  // those were lost with the link, and are not missed
            received_ = hello->first;
        }
        sender_ = &connection;
        told_received_ = told_released_ = UINT64_MAX;  // so that it is told
        change([](LinkState& state) {
            state.connected = true;
            ++state.connections;
        });
        log(LogLevel::info, "the renderer's machine sends frames of {}", name_);
    }

    static std::string printable(std::string text) {
        for (char& letter : text)
            if (static_cast<unsigned char>(letter) < ' ' || letter == 127) letter = '?';
        return text;
    }

    bool open_stream(Connection& connection, const Hello& hello) {
        if (is_fetching_) return connection.is_left = true, false;  // into the last one's slots: it will come again
        share_stream_abandon(std::exchange(stream_, nullptr));
        description_ = share_description_from_wire(&hello.stream);
        share_layout layout;
        if (share_lay_out(&description_, &layout) != CLARUS_SHARE_OK) {
            refuse(connection, SHARE_NONSENSE, fmt::format("a stream that cannot be: {}", clarus_share_last_error()));
            return false;
        }
        if (layout.slot_bytes != hello.stream.slot_bytes) {
            refuse(connection, SHARE_NONSENSE,
                   fmt::format("a stream whose slots have {} bytes where {} follow from it", hello.stream.slot_bytes,
                               layout.slot_bytes));
            return false;
        }
        if (clarus_share_open(name_.c_str(), &description_, &stream_) != CLARUS_SHARE_OK) {
            refuse(connection, SHARE_REFUSES, clarus_share_last_error());
            return false;
        }
        layout_ = layout;
        said_ = hello.stream;
        session_ = hello.session;
        base_ = received_ = hello.first;
        is_broken_off_ = false;
        told_words_.clear();
        arrived_.clear();
        return true;
    }

    /// Whether it was taken.
    bool hear_frame(const Message& message) {
        const std::optional<Frame> frame = read<Frame>(message, kFrame);
        if (!frame || !message.data || message.data_bytes != layout_.slot_bytes - SHARE_PAGE_BYTES ||
            frame->index != received_ + arrived_.size() + is_fetching_ ||
            arrived_.size() + is_fetching_ >= static_cast<size_t>(description_.slots))
            return false;
        clarus_share_frame checked{};
        share_frame_from_wire(&frame->frame, &checked);
        if (frame->frame.reserved != 0 || share_check_frame(&description_, &checked) != CLARUS_SHARE_OK) return false;
        arrived_.push_back({message, frame->frame});
        return true;
    }

    void hear_sender(Connection& connection, const Message& message, uint32_t type) {
        if (type == SHARE_LEAVE) {
            const auto leave = begin_of<share_leave>(message);
            sender_ = nullptr;
            connection.is_left = true;
            change([](LinkState& state) { state.connected = false; });
            if (leave.reason == SHARE_ENDS && !is_fetching_)
                clarus_share_close(std::exchange(stream_, nullptr));
            else
                is_broken_off_ = true;
            return;
        }
        if (type == kAlive && read<Alive>(message, type)) return;
        refuse(connection, SHARE_NONSENSE,
               type == kFrame ? "a frame that cannot be: of another index, size or parameters than are due"
                              : "a message that is not due");
    }

    // ---- frames ----

    /// Upscalers are let in and heard.
    void attend_stream() {
        if (!stream_) return;
        if (is_broken_off_ && !is_fetching_) return share_stream_abandon(std::exchange(stream_, nullptr));
        clarus_share_frame frame;
        const clarus_share_status status = clarus_share_begin(stream_, 0, &frame);
        has_place_ = status == CLARUS_SHARE_OK;
        if (has_place_) place_ = frame;
        if (!has_place_ && status != CLARUS_SHARE_TIMED_OUT) fail(ErrorKind::file, "{}", clarus_share_last_error());
        const clarus_share_state state = clarus_share_stream_state(stream_);
        if (!state.connected && *state.message && sender_) {
            const std::string words = state.message;
            if (words != told_words_) say_goodbye(*sender_, SHARE_REFUSES, told_words_ = words);
        }
    }

    void fetch_next() {
        if (!stream_ || !has_place_ || is_fetching_ || arrived_.empty()) return;
        Arrived arrived = std::move(arrived_.front());
        arrived_.pop_front();
        is_fetching_ = true;
        is_orphaned_ = false;
        fetching_from_ = arrived.message.from;
        fetching_since_ = Clock::now();
        auto* slot = static_cast<std::byte*>(place_.images[CLARUS_SHARE_COLOR].pixels) -
                     layout_.image_offset[CLARUS_SHARE_COLOR];
        worker_->fetch(arrived.message, slot + SHARE_PAGE_BYTES,
                       [this, frame = place_, header = arrived.header](bool came) { fetched(frame, header, came); });
    }

    void fetched(clarus_share_frame frame, const share_frame_header& header, bool came) {
        is_fetching_ = false;
        if (!came || !stream_) return;  // the slot is begun anew
        share_frame_from_wire(&header, &frame);
        if (clarus_share_end(stream_, &frame) != CLARUS_SHARE_OK) return;  // it was checked before
        ++received_;
        change([](LinkState& state) { ++state.frames; });
    }

    void report() {
        if (!sender_ || !stream_) return;
        // Whether a frame of a connection that is gone has come, after all, is known when its fetching ends.
        if (is_fetching_ && is_orphaned_) return;
        const uint64_t released = base_ + clarus_share_stream_state(stream_).released;
        if (received_ != told_received_ || released != told_released_) {
            told_received_ = received_;
            told_released_ = released;
            sender_->endpoint.send(Progress{share_make_head(kProgress, sizeof(Progress)), received_, released});
            sender_->said = Clock::now();
        } else if (Clock::now() - sender_->said > kHeartbeat) {
            sender_->said = Clock::now();
            sender_->endpoint.send(Alive{share_make_head(kAlive, sizeof(Alive))});
        }
    }

    std::string name_;
    Address at_;
    std::unique_ptr<Worker> worker_;
    std::list<Connection> connections_;  // go before the worker
    Connection* sender_ = nullptr;       // of these

    clarus_share_stream* stream_ = nullptr;  // that the sender's frames are shared by
    clarus_share_description description_{};
    share_layout layout_{};
    share_stream_packet said_{};                                     // by which it was described
    uint64_t session_ = 0, base_ = 0;                                // base: index of the stream's first frame
    uint64_t received_ = 0, told_received_ = 0, told_released_ = 0;  // indices
    bool is_broken_off_ = false;                                     // the sender has left for good
    std::string told_words_;                                         // of the upscaler's

    std::deque<Arrived> arrived_;
    bool has_place_ = false, is_fetching_ = false;
    bool is_orphaned_ = false;  // what is being fetched is of a connection that is gone
    ucp_ep_h fetching_from_ = nullptr;
    clarus_share_frame place_{};
    Clock::time_point fetching_since_{};

    mutable std::mutex mutex_;
    LinkState state_;
    Bell bell_;
    std::atomic<bool> stop_ = false;
    std::thread thread_;
};

}  // namespace

std::unique_ptr<Link> make_receiver(const std::string& name, const Address& at) {
    return std::make_unique<Receiver>(name, at);
}

}  // namespace clarus::link
