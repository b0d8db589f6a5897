#include "report/server.h"

#include <utility>

#include "base/error.h"
#include "base/module.h"
#include "report/server_module.h"

namespace clarus::report {
namespace {

const ServerModule& server_module() {
    try {
        static const ServerModule& module = module_function<const ServerModule&()>("clarus_server", "clarus_server")();
        return module;
    } catch (const Error& error) {
        fail(error.kind(),
             "no page can be served: libmicrohttpd was not found when this clarus was built (Debian's "
             "libmicrohttpd-dev), or is not installed; `clarus report` writes the page to a file: {}",
             error.what());
    }
}

}  // namespace

std::unique_ptr<PageServer> serve_page(int port, CurrentPage page) {
    return server_module().serve(port, std::move(page));
}

}  // namespace clarus::report
