#include "link/address.h"

#include <fmt/format.h>
#include <ifaddrs.h>
#include <netdb.h>
#include <netinet/in.h>
#include <unistd.h>

#include <cstdint>
#include <cstring>
#include <memory>

#include "base/error.h"
#include "base/parse.h"
#include "clarus/share.h"
#include "share/endpoint.h"

namespace clarus::link {
namespace {

/// The host's bytes, without the port.
std::string host_bytes(const sockaddr* address) {
    if (!address) return {};
    if (address->sa_family == AF_INET) {
        const auto& host = reinterpret_cast<const sockaddr_in*>(address)->sin_addr;
        return {reinterpret_cast<const char*>(&host), sizeof host};
    }
    if (address->sa_family == AF_INET6) {
        const auto& host = reinterpret_cast<const sockaddr_in6*>(address)->sin6_addr;
        return {reinterpret_cast<const char*>(&host), sizeof host};
    }
    return {};
}

}  // namespace

std::string Address::text() const {
    return host.find(':') == std::string::npos ? host + ":" + port : "[" + host + "]:" + port;
}

Address parse_address(const std::string& text, const std::string& option) {
    const size_t colon = text.rfind(':');
    Address address;
    address.port = colon == std::string::npos ? text : text.substr(colon + 1);
    if (colon != std::string::npos) address.host = text.substr(0, colon);
    if (address.host.size() > 2 && address.host.starts_with('[') && address.host.ends_with(']'))
        address.host = address.host.substr(1, address.host.size() - 2);
    if (address.host.empty()) address.host = "127.0.0.1";
    const auto port = parse_whole<uint16_t>(address.port);
    if (!port || *port == 0)
        fail(ErrorKind::invalid_argument, "{} {}: not HOST:PORT, such as 192.168.1.7:7788, with a port from 1 to 65535",
             option, text);
    return address;
}

std::optional<RemoteStream> parse_remote_stream(const std::string& text, const std::string& option) {
    constexpr std::string_view kScheme = "ucx:";
    if (!text.starts_with(kScheme)) return std::nullopt;
    const size_t slash = text.find('/');
    if (slash == std::string::npos)
        fail(ErrorKind::invalid_argument, "{} {}: not ucx:HOST:PORT/NAME, such as ucx:192.168.1.7:7788/game", option,
             text);
    RemoteStream remote{parse_address(text.substr(kScheme.size(), slash - kScheme.size()), option),
                        text.substr(slash + 1)};
    if (share_check_name(remote.name.c_str()) != CLARUS_SHARE_OK)
        fail(ErrorKind::invalid_argument, "{} {}: {}", option, text, clarus_share_last_error());
    return remote;
}

SocketAddress resolve(const Address& address) {
    addrinfo hints{}, *found = nullptr;
    hints.ai_socktype = SOCK_STREAM;
    const int error = getaddrinfo(address.host.c_str(), address.port.c_str(), &hints, &found);
    if (error != 0) fail(ErrorKind::file, "there is no machine {}: {}", address.host, gai_strerror(error));
    const std::unique_ptr<addrinfo, void (*)(addrinfo*)> freed(found, freeaddrinfo);
    SocketAddress result;
    result.size = found->ai_addrlen;
    std::memcpy(&result.storage, found->ai_addr, found->ai_addrlen);
    return result;
}

std::string device_at(const SocketAddress& own) {
    ifaddrs* all = nullptr;
    if (getifaddrs(&all) != 0) return {};
    const std::unique_ptr<ifaddrs, void (*)(ifaddrs*)> freed(all, freeifaddrs);
    const std::string host = host_bytes(own.get());
    for (const ifaddrs* each = all; each; each = each->ifa_next)
        if (host_bytes(each->ifa_addr) == host) return each->ifa_name;
    return {};
}

std::string device_towards(const SocketAddress& other) {
    const int probe = socket(other.storage.ss_family, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    SocketAddress own;
    own.size = sizeof own.storage;
    const bool has_way = probe >= 0 && connect(probe, other.get(), other.size) == 0 &&
                         getsockname(probe, reinterpret_cast<sockaddr*>(&own.storage), &own.size) == 0;
    if (probe >= 0) close(probe);
    return has_way ? device_at(own) : "";
}

}  // namespace clarus::link
