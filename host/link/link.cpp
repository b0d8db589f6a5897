#include "link/link.h"

#include <cstdlib>
#include <utility>

#include "base/error.h"
#include "base/log.h"
#include "base/module.h"

namespace clarus::link {
namespace {

const LinkModule& module() {
    // UCX reads its settings when it is loaded. Those that the user has set stay.
    for (const auto& [name, value] : {std::pair{"UCX_LOG_LEVEL", "fatal"},  // what goes wrong is told by Link
                                      {"UCX_HANDLE_ERRORS", "none"},        // this program's signals are its own
                                      {"UCX_MEM_EVENTS", "n"},              // and so is its malloc
                                      {"UCX_WARN_UNUSED_ENV_VARS", "n"},
                                      {"UCX_CM_REUSEADDR", "y"}})  // who was killed can listen again at once
        setenv(name, value, 0);
    try {
        return module_function<const LinkModule&()>("clarus_ucx", "clarus_link_module")();
    } catch (const Error& error) {
        fail(error.kind(),
             "frames cannot go to another machine: UCX was not found when this clarus was built (Debian's libucx-dev), "
             "or is not installed: {}",
             error.what());
    }
}

}  // namespace

std::unique_ptr<Link> send_frames(const std::string& name, const RemoteStream& to) {
    return module().send(name, to, log_message);
}

std::unique_ptr<Link> receive_frames(const std::string& name, const Address& at) {
    return module().receive(name, at, log_message);
}

}  // namespace clarus::link
