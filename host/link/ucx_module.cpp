#include <utility>

#include "base/log.h"
#include "link/sides.h"

extern "C" __attribute__((visibility("default"))) const clarus::link::LinkModule& clarus_link_module() {
    using namespace clarus;
    using namespace clarus::link;
    // The module's log is not the program's.
    static const LinkModule module{[](const std::string& name, const RemoteStream& to, LogCallback log) {
                                       set_log_callback(std::move(log));
                                       return make_sender(name, to);
                                   },
                                   [](const std::string& name, const Address& at, LogCallback log) {
                                       set_log_callback(std::move(log));
                                       return make_receiver(name, at);
                                   }};
    return module;
}
