#pragma once

#include <memory>

#include "report/server.h"

namespace clarus::report {

/// All that Clarus asks of libmicrohttpd, in a module that a build may be without.
class ServerModule {
  public:
    virtual std::unique_ptr<PageServer> serve(int port, CurrentPage page) const = 0;

  protected:
    ~ServerModule() = default;
};

}  // namespace clarus::report
