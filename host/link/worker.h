#pragma once

#include <ucp/api/ucp.h>

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <initializer_list>
#include <memory>
#include <string>
#include <vector>

#include "link/address.h"

namespace clarus::link {

/// A message that came: its header, and where there are data to be fetched, what UCX knows them by.
struct Message {
    ucp_ep_h from;
    std::vector<std::byte> header;
    void* data = nullptr;  // to be given to Worker::fetch or Worker::drop
    size_t data_bytes = 0;
};

/// UCX's progress in one thread. Callbacks only write down what came; nothing is done inside them.
class Worker {
  public:
    /// Of the network's devices, only `device` is used, unless it is empty or UCX_NET_DEVICES says which. Errors: file.
    explicit Worker(const std::string& device);
    ~Worker();
    Worker(const Worker&) = delete;
    Worker& operator=(const Worker&) = delete;

    /// Errors: file.
    void listen(const Address& at);

    bool progress();  // whether there was any
    /// Until UCX has something to do, a descriptor is readable, or the time is over. Descriptors may be -1.
    void wait(const std::vector<int>& descriptors, int milliseconds);

    std::deque<Message> messages;             // that came
    std::deque<ucp_conn_request_h> requests;  // for a connection

    /// Receives a message's data. `done` is called by `progress`, with whether they came. They are written until then.
    void fetch(const Message& message, void* to, std::function<void(bool)> done);
    void drop(const Message& message);

    ucp_worker_h get() const { return worker_; }

  private:
    friend class Endpoint;
    struct Requested;  // what UCX is asked for and has not done yet

    void request(ucs_status_ptr_t request, std::unique_ptr<Requested> requested);
    static void finished(Requested* requested, ucs_status_t status);
    void settle(int milliseconds, const std::function<bool()>& settled);

    ucp_context_h context_ = nullptr;
    ucp_worker_h worker_ = nullptr;
    ucp_listener_h listener_ = nullptr;
    int events_ = -1;
    size_t under_way_ = 0;
};

/// One end of a connection. Closed at once when it goes.
class Endpoint {
  public:
    /// Errors: file.
    Endpoint(Worker& worker, const SocketAddress& to);
    Endpoint(Worker& worker, ucp_conn_request_h request);
    ~Endpoint();
    Endpoint(const Endpoint&) = delete;
    Endpoint& operator=(const Endpoint&) = delete;

    ucp_ep_h get() const { return endpoint_; }
    bool is_broken() const { return state_->is_broken; }
    std::string why() const { return state_->why; }

    /// `Header` is plain data. What is sent to a broken end is lost.
    template <typename Header>
    void send(const Header& header) {
        send(&header, sizeof header, nullptr, 0, {});
    }
    /// With data that the other side fetches from where they are, which stay there until `done` is called by
    /// Worker::progress.
    template <typename Header>
    void send(const Header& header, const void* data, size_t bytes, std::function<void(bool)> done) {
        send(&header, sizeof header, data, bytes, std::move(done));
    }
    /// Waits until all has gone, or so long.
    void flush(int milliseconds);

  private:
    struct State {
        bool is_broken = false;
        std::string why;
        size_t under_way = 0;
    };

    void create(ucp_ep_params_t& parameters);
    void send(const void* header, size_t header_bytes, const void* data, size_t bytes, std::function<void(bool)> done);

    Worker& worker_;
    ucp_ep_h endpoint_ = nullptr;
    std::shared_ptr<State> state_ = std::make_shared<State>();
};

}  // namespace clarus::link
