#pragma once

#include <functional>
#include <memory>
#include <string>

namespace clarus::report {

/// A page (report/page.h) as it is at one time.
struct ServedPage {
    std::string version;  // another one for every page
    std::string text;
};

/// The page as it is now; called for every request, on the server's thread, which waits for it.
using CurrentPage = std::function<std::shared_ptr<const ServedPage>()>;

/// Serves one page by HTTP to this machine alone, on a thread of its own, until it is destroyed: `/`, and its version
/// as
/// `/version`, to GET and HEAD, of hosts that are named localhost, 127.0.0.1 or [::1]. Nothing that a request says
/// leads to a file. A request's head has 32 KiB at most; of 32 connections each is closed that does nothing for ten
/// seconds, and none keeps others waiting.
class PageServer {
  public:
    virtual ~PageServer() = default;
    virtual int port() const = 0;
};

/// Listens at 127.0.0.1; `port` 0 is any that is free. Errors: file, naming the port where it is taken; where this
/// build has no server.
std::unique_ptr<PageServer> serve_page(int port, CurrentPage page);

}  // namespace clarus::report
