#include "cli/control_server.h"

#include <poll.h>

#include <optional>
#include <utility>

#include "base/error.h"
#include "base/explain.h"
#include "base/json_text.h"
#include "cli/share_error.h"
#include "io/json_reader.h"

namespace clarus::cli {
namespace {

using nlohmann::json;

constexpr size_t kLargestPacket = 60000;
constexpr int kStopMilliseconds = 100;  // how long the server may take to stop
constexpr int kConnectMilliseconds = 5000;
constexpr int kStateMilliseconds = 20000;    // behind others' changes
constexpr int kChangeMilliseconds = 300000;  // a kernel that compiles tells no progress
constexpr int kRequestMilliseconds = 1000;   // who connects and asks nothing for so long is left

void send(int connection, const json& packet) {
    const std::string text = json_text(packet);
    share_send(connection, text.data(), text.size(), nullptr, 0);
}

bool waits_long(int socket, int milliseconds) {
    pollfd event{socket, POLLIN, 0};
    return poll(&event, 1, milliseconds) <= 0;
}

/// None where the other side has gone; null where it is no JSON.
std::optional<json> receive(int connection) {
    std::string text(kLargestPacket, '\0');
    const ssize_t bytes = share_receive(connection, text.data(), text.size(), nullptr, 0, nullptr);
    if (bytes <= 0) return std::nullopt;
    text.resize(std::min(static_cast<size_t>(bytes), text.size()));
    return io::try_parse_json(text).value_or(json());
}

}  // namespace

ControlServer::ControlServer(const std::string& name, Answer answer) : answer_(std::move(answer)) {
    const clarus_share_status status = share_listen(name.c_str(), SHARE_CONTROL_SUFFIX, &endpoint_);
    if (status == CLARUS_SHARE_NAME_IN_USE)
        fail(ErrorKind::file, "{} is served by another process already (`clarus control {}` tells how): {}", name, name,
             clarus_share_last_error());
    check_share(status);
    try {
        thread_ = std::thread([this] {
            while (!stop_) {
                if (waits_long(endpoint_.socket, kStopMilliseconds)) continue;
                int connection = share_accept(endpoint_.socket);
                if (connection >= 0) serve(connection);
                share_close(&connection);
            }
        });
    } catch (...) {
        share_stop_listening(&endpoint_);
        throw;
    }
}

ControlServer::~ControlServer() {
    stop_ = true;
    thread_.join();
    share_stop_listening(&endpoint_);
}

void ControlServer::serve(int connection) const {
    if (waits_long(connection, kRequestMilliseconds)) return;
    try {
        const std::optional<json> request = receive(connection);
        if (!request) return;
        if (!request->is_object()) fail(ErrorKind::invalid_argument, "a request is a JSON object");
        const auto progress = [&](double done) {
            if (stop_) fail(ErrorKind::file, "the server is ending");
            send(connection, {{"progress", done}});
        };
        send(connection, {{"answer", answer_(*request, progress)}});
    } catch (const std::exception& error) {
        send(connection, {{"error", explain(error)}});
    }
}

json ask_server(const std::string& name, const json& request, const ControlServer::Progress& progress) {
    int connection = -1;
    clarus_share_status status = CLARUS_SHARE_TIMED_OUT;
    for (int tries = 0; status == CLARUS_SHARE_TIMED_OUT && tries < kConnectMilliseconds; ++tries) {
        if (tries > 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
        status = share_connect(name.c_str(), SHARE_CONTROL_SUFFIX, &connection);
    }
    if (status == CLARUS_SHARE_NO_STREAM)
        fail(ErrorKind::file, "nobody serves {}: {}; `clarus serve {} --model …` does", name, clarus_share_last_error(),
             name);
    check_share(status);
    const std::unique_ptr<int, void (*)(int*)> closed(&connection, share_close);
    send(connection, request);
    for (;;) {
        if (waits_long(connection, request.empty() ? kStateMilliseconds : kChangeMilliseconds))
            fail(ErrorKind::file, "the server of {} does not answer; is it stopped, or does its device hang?", name);
        const std::optional<json> packet = receive(connection);
        if (!packet || !packet->is_object()) fail(ErrorKind::file, "the server of {} went without an answer", name);
        if (packet->contains("progress")) {
            progress((*packet)["progress"].get<double>());
            continue;
        }
        if (packet->contains("error")) fail(ErrorKind::invalid_argument, "{}", (*packet)["error"].get<std::string>());
        return packet->value("answer", json());
    }
}

}  // namespace clarus::cli
