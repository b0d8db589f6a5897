#include "report/server_module.h"

#include <arpa/inet.h>
#include <microhttpd.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include "base/error.h"

namespace clarus::report {
namespace {

constexpr unsigned most_connections = 32, idle_seconds = 10;
constexpr size_t most_head_bytes = size_t{32} << 10;

std::string words_of(int error) { return std::generic_category().message(error); }

/// A socket that listens, until it is handed on.
class Listener {
  public:
    explicit Listener(int port) : socket_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
        if (socket_ < 0) fail(ErrorKind::file, "cannot listen at 127.0.0.1: {}", words_of(errno));
        // A port whose last connections are still being forgotten is free; one that somebody listens at is not.
        const int yes = 1;
        setsockopt(socket_, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
        sockaddr_in address{};
        address.sin_family = AF_INET;
        address.sin_port = htons(static_cast<uint16_t>(port));
        address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        socklen_t size = sizeof address;
        auto* const any = reinterpret_cast<sockaddr*>(&address);
        if (bind(socket_, any, size) != 0 || listen(socket_, most_connections) != 0 ||
            getsockname(socket_, any, &size) != 0) {
            const int error = errno;
            close(socket_);
            fail(ErrorKind::file, "cannot listen at 127.0.0.1:{}: {}{}", port, words_of(error),
                 error == EADDRINUSE ? "; take another --port, or none for any that is free" : "");
        }
        port_ = ntohs(address.sin_port);
    }
    ~Listener() {
        if (socket_ >= 0) close(socket_);
    }
    Listener(const Listener&) = delete;
    Listener& operator=(const Listener&) = delete;

    int port() const { return port_; }
    int get() const { return socket_; }
    void release() { socket_ = -1; }

  private:
    int socket_, port_ = 0;
};

/// A page of another site may have its own name lead here (DNS rebinding): then this is not the name that the browser
/// sends. The port may be another one, of a tunnel.
bool is_this_machine(const char* host) {
    if (!host) return false;
    std::string_view name = host;
    if (const size_t colon = name.rfind(':'); colon != name.npos && name.find(']', colon) == name.npos) {
        const std::string_view port = name.substr(colon + 1);
        if (port.empty() || port.size() > 5 || port.find_first_not_of("0123456789") != port.npos) return false;
        name = name.substr(0, colon);
    }
    constexpr std::array<std::string_view, 3> names{"localhost", "127.0.0.1", "[::1]"};
    return std::ranges::find(names, name) != names.end();
}

MHD_Result send(MHD_Connection* connection, unsigned status, MHD_Response* response, const char* type) {
    if (!response) return MHD_NO;
    for (const auto& [name, value] : {std::pair{MHD_HTTP_HEADER_CONTENT_TYPE, type},
                                      {MHD_HTTP_HEADER_CACHE_CONTROL, "no-store"},
                                      {"X-Content-Type-Options", "nosniff"},
                                      {"Cross-Origin-Resource-Policy", "same-origin"},
                                      {"Referrer-Policy", "no-referrer"},
                                      {"Content-Security-Policy", "frame-ancestors 'none'"}})
        MHD_add_response_header(response, name, value);
    if (status == MHD_HTTP_METHOD_NOT_ALLOWED) MHD_add_response_header(response, MHD_HTTP_HEADER_ALLOW, "GET, HEAD");
    const MHD_Result result = MHD_queue_response(connection, status, response);
    MHD_destroy_response(response);
    return result;
}

constexpr const char* plain_text = "text/plain; charset=utf-8";

MHD_Result refuse(MHD_Connection* connection, unsigned status, std::string_view words) {
    return send(connection, status,
                MHD_create_response_from_buffer(words.size(), const_cast<char*>(words.data()), MHD_RESPMEM_PERSISTENT),
                plain_text);
}

using Page = std::shared_ptr<const ServedPage>;

void let_go(void* page) { delete static_cast<Page*>(page); }

/// A part of the page, which lives as long as it is sent.
MHD_Result send_part(MHD_Connection* connection, const Page& page, const std::string& part, const char* type) {
    auto holder = std::make_unique<Page>(page);
    MHD_Response* response = MHD_create_response_from_buffer_with_free_callback_cls(
        part.size(), const_cast<char*>(part.data()), &let_go, holder.get());
    if (response) static_cast<void>(holder.release());
    return send(connection, MHD_HTTP_OK, response, type);
}

class Server : public PageServer {
  public:
    Server(int port, CurrentPage page) : page_(std::move(page)) {
        Listener listener(port);
        port_ = listener.port();
        daemon_ = MHD_start_daemon(MHD_USE_AUTO | MHD_USE_INTERNAL_POLLING_THREAD, 0, nullptr, nullptr, &Server::answer,
                                   this, MHD_OPTION_LISTEN_SOCKET, listener.get(), MHD_OPTION_CONNECTION_LIMIT,
                                   most_connections, MHD_OPTION_CONNECTION_TIMEOUT, idle_seconds,
                                   MHD_OPTION_CONNECTION_MEMORY_LIMIT, most_head_bytes, MHD_OPTION_END);
        if (!daemon_) fail(ErrorKind::file, "cannot listen at 127.0.0.1:{}: libmicrohttpd does not start", port_);
        listener.release();
    }
    ~Server() override { MHD_stop_daemon(daemon_); }
    Server(const Server&) = delete;
    Server& operator=(const Server&) = delete;

    int port() const override { return port_; }

  private:
    static MHD_Result answer(void* self, MHD_Connection* connection, const char* url, const char* method, const char*,
                             const char*, size_t*, void**) {
        try {
            return static_cast<Server*>(self)->answer(connection, url, method);
        } catch (const std::exception&) {  // No memory: the connection is closed.
            return MHD_NO;
        }
    }

    MHD_Result answer(MHD_Connection* connection, std::string_view url, std::string_view method) const {
        if (!is_this_machine(MHD_lookup_connection_value(connection, MHD_HEADER_KIND, MHD_HTTP_HEADER_HOST)))
            return refuse(connection, MHD_HTTP_FORBIDDEN, "Only localhost, 127.0.0.1 and [::1] are served.\n");
        if (method != MHD_HTTP_METHOD_GET && method != MHD_HTTP_METHOD_HEAD)
            return refuse(connection, MHD_HTTP_METHOD_NOT_ALLOWED, "Only GET and HEAD are served.\n");
        if (url != "/" && url != "/version")
            return refuse(connection, MHD_HTTP_NOT_FOUND, "Only / and /version are served.\n");
        const Page page = page_();
        return url == "/" ? send_part(connection, page, page->text, "text/html; charset=utf-8")
                          : send_part(connection, page, page->version, plain_text);
    }

    CurrentPage page_;
    MHD_Daemon* daemon_ = nullptr;
    int port_ = 0;
};

class Microhttpd final : public ServerModule {
  public:
    std::unique_ptr<PageServer> serve(int port, CurrentPage page) const override {
        return std::make_unique<Server>(port, std::move(page));
    }
};

}  // namespace
}  // namespace clarus::report

extern "C" __attribute__((visibility("default"))) const clarus::report::ServerModule& clarus_server() {
    static const clarus::report::Microhttpd instance;
    return instance;
}
