#pragma once

#include <atomic>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>

#include "share/endpoint.h"

namespace clarus::cli {

/// Answers `clarus control` on a thread of its own: one request a connection, JSON either way.
class ControlServer {
  public:
    using Progress = std::function<void(double)>;  // 0…1
    /// An Error that it throws is the answer then.
    using Answer = std::function<nlohmann::json(const nlohmann::json& request, const Progress& progress)>;

    /// Errors: file where another process has the name.
    ControlServer(const std::string& name, Answer answer);
    ~ControlServer();
    ControlServer(const ControlServer&) = delete;
    ControlServer& operator=(const ControlServer&) = delete;

  private:
    void serve(int connection) const;

    Answer answer_;
    share_endpoint endpoint_{};
    std::atomic<bool> stop_ = false;
    std::thread thread_;
};

/// Asks the server of this name. Errors: file where there is none, or it goes without an answer; invalid_argument with
/// its own words.
nlohmann::json ask_server(const std::string& name, const nlohmann::json& request,
                          const ControlServer::Progress& progress);

}  // namespace clarus::cli
