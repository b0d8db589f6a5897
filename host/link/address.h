#pragma once

#include <sys/socket.h>

#include <optional>
#include <string>

namespace clarus::link {

/// Where a machine listens.
struct Address {
    std::string host;  // a name or number; of IPv6 without brackets
    std::string port;

    std::string text() const;
};

/// "HOST:PORT", "[HOST]:PORT", or "PORT" or ":PORT" for this machine alone (127.0.0.1). Errors: invalid_argument,
/// naming `option`.
Address parse_address(const std::string& text, const std::string& option);

/// "ucx:HOST:PORT/NAME": a stream on another machine.
struct RemoteStream {
    Address address;
    std::string name;
};
/// None where the text does not begin with "ucx:". Errors: invalid_argument where it does and is wrong.
std::optional<RemoteStream> parse_remote_stream(const std::string& text, const std::string& option);

/// Errors: file, where the host is not known.
struct SocketAddress {
    sockaddr_storage storage{};
    socklen_t size = 0;

    const sockaddr* get() const { return reinterpret_cast<const sockaddr*>(&storage); }
};
SocketAddress resolve(const Address& address);

/// The network device that has this address of the machine's own; empty where none has.
std::string device_at(const SocketAddress& own);
/// The network device by which the machine reaches another's address; empty where it does not.
std::string device_towards(const SocketAddress& other);

}  // namespace clarus::link
