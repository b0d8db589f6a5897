#include <unistd.h>

#include <algorithm>
#include <string>

#include "cli/control_server.h"
#include "cli/share_error.h"

using namespace clarus;

namespace {

nlohmann::json answer(const nlohmann::json& request, const cli::ControlServer::Progress& progress) {
    progress(0.5);
    return request;
}

}  // namespace

/// A request to a server of this process, until it has answered.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    constexpr size_t largest_packet = 60000;
    static const std::string name = "fuzz" + std::to_string(getpid());
    static const cli::ControlServer server(name, answer);
    int connection = -1;
    clarus_share_status status = CLARUS_SHARE_TIMED_OUT;
    while (status == CLARUS_SHARE_TIMED_OUT) status = share_connect(name.c_str(), SHARE_CONTROL_SUFFIX, &connection);
    cli::check_share(status);
    share_send(connection, data, std::min(size, largest_packet), nullptr, 0);
    std::string packet(largest_packet, '\0');
    while (share_receive(connection, packet.data(), packet.size(), nullptr, 0, nullptr) > 0) {
    }
    share_close(&connection);
    return 0;
}
